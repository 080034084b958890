//! Connections of linear systems: channels, series, parallel and feedback connection.

use nalgebra::DMatrix;

use super::eigen::{balance, eigenvalues_of};
use super::extended::{Entry, Extended, extended, product, solved, sum};
use super::{Complex, StateSpace, eigenvalues};

/// Failure of several loops with a delay.
pub(super) const SEVERAL_DELAYED: &str =
    "several cut loops with a delay are not supported; replace the delay by a Padé approximation";

impl StateSpace {
    /// Creates a system without delay, with states `x1`, `x2`, ..., inputs `u1`, ... and outputs `y1`, ....
    ///
    /// # Panics
    /// If the dimensions of the matrices do not match.
    pub fn new(a: DMatrix<f64>, b: DMatrix<f64>, c: DMatrix<f64>, d: DMatrix<f64>) -> Self {
        assert!(a.is_square() && a.nrows() == b.nrows() && a.ncols() == c.ncols(), "states of A, B and C");
        assert!(d.nrows() == c.nrows() && d.ncols() == b.ncols(), "inputs and outputs of B, C and D");
        let names = |letter: char, count: usize| (1..=count).map(|i| format!("{letter}{i}")).collect();
        let (states, inputs, outputs) = (names('x', a.nrows()), names('u', b.ncols()), names('y', c.nrows()));
        Self { a, b, c, d, states, inputs, outputs, delay: 0.0, period: None }
    }

    /// Returns the number of states.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// Returns the poles, 1/s: eigenvalues of `A`, or `ln(z)/T` of the poles z of a sampled system, except z = 0.
    ///
    /// # Errors
    /// If an entry is not finite.
    pub fn poles(&self) -> Result<Vec<Complex>, String> {
        Ok(self.in_seconds(eigenvalues(&self.a)?))
    }

    /// Returns the poles, 1/s, of the closed loop with unity negative feedback, when the loop transfer function is
    /// multiplied by `gain`.
    ///
    /// # Errors
    /// See [`StateSpace::complementary_sensitivity`].
    pub fn closed_loop_poles(&self, gain: f64) -> Result<Vec<Complex>, String> {
        Ok(self.in_seconds(self.closed_loop_eigenvalues(gain)?))
    }

    /// Returns the eigenvalues of `A - gain B (1 + gain D)^-1 C`, whose rounding errors would move poles in badly
    /// scaled coordinates.
    pub(super) fn closed_loop_eigenvalues(&self, gain: f64) -> Result<Vec<Complex>, String> {
        self.check_closable()?;
        let by = |m: &DMatrix<f64>| m.map(|x| Extended::from(x) * Extended::from(gain));
        let n = self.d.nrows();
        let outer =
            solved(sum(&extended(&DMatrix::identity(n, n)), &by(&self.d)), by(&self.c)).ok_or_else(not_well_posed)?;
        let fed_back = product(&extended(&self.b), &outer).map(|x| -x);
        eigenvalues_of(&sum(&extended(&self.a), &fed_back), f64::EPSILON)
    }

    /// Returns true if every pole lies in the open left half-plane, or in the unit circle.
    ///
    /// # Errors
    /// If an entry is not finite.
    pub fn is_stable(&self) -> Result<bool, String> {
        Ok(eigenvalues(&self.a)?.iter().all(|pole| pole.re < 0.0))
    }

    /// Returns the system with its states scaled by powers of two, so that the entries of `A` have similar magnitude.
    #[must_use]
    pub(super) fn balanced(&self) -> Self {
        let mut system = self.clone();
        for (i, scale) in balance(&mut system.a).into_iter().enumerate() {
            system.b.row_mut(i).unscale_mut(scale);
            system.c.column_mut(i).scale_mut(scale);
        }
        system
    }

    /// Returns the system from one input to one output, given by their indices.
    #[must_use]
    pub fn channel(&self, input: usize, output: usize) -> Self {
        Self {
            b: self.b.columns(input, 1).into_owned(),
            c: self.c.rows(output, 1).into_owned(),
            d: self.d.view((output, input), (1, 1)).into_owned(),
            inputs: vec![self.inputs[input].clone()],
            outputs: vec![self.outputs[output].clone()],
            ..self.clone()
        }
    }

    /// Returns the series connection in which the outputs of this system drive `next`; the delays add up.
    ///
    /// # Panics
    /// If `next` does not have one input per output of this system, or another sampling period.
    #[must_use]
    pub fn series(&self, next: &Self) -> Self {
        assert_eq!(self.outputs.len(), next.inputs.len(), "one input per output");
        assert_eq!(self.period, next.period, "one sampling period");
        let (n, m) = (self.order(), next.order());
        let mut a = DMatrix::zeros(n + m, n + m);
        a.view_mut((0, 0), (n, n)).copy_from(&self.a);
        a.view_mut((n, 0), (m, n)).copy_from(&(&next.b * &self.c));
        a.view_mut((n, n), (m, m)).copy_from(&next.a);
        Self {
            a,
            b: above(&self.b, &(&next.b * &self.d)),
            c: beside(&(&next.d * &self.c), &next.c),
            d: &next.d * &self.d,
            states: self.states.iter().chain(&next.states).cloned().collect(),
            inputs: self.inputs.clone(),
            outputs: next.outputs.clone(),
            delay: self.delay + next.delay,
            period: self.period,
        }
    }

    /// Returns the parallel connection: the sum of this system and another with the same input.
    ///
    /// # Errors
    /// If the delays differ.
    ///
    /// # Panics
    /// If the numbers of inputs or outputs, or the sampling periods differ.
    pub fn parallel(&self, other: &Self) -> Result<Self, String> {
        assert_eq!(self.period, other.period, "one sampling period");
        if self.delay != other.delay {
            return Err("systems with different delays cannot be added without further states".to_owned());
        }
        let (n, m) = (self.order(), other.order());
        let mut a = DMatrix::zeros(n + m, n + m);
        a.view_mut((0, 0), (n, n)).copy_from(&self.a);
        a.view_mut((n, n), (m, m)).copy_from(&other.a);
        Ok(Self {
            a,
            b: above(&self.b, &other.b),
            c: beside(&self.c, &other.c),
            d: &self.d + &other.d,
            states: self.states.iter().chain(&other.states).cloned().collect(),
            ..self.clone()
        })
    }

    /// Returns the closed loop with unity negative feedback, `T = L/(1 + L)`: from the reference to the outputs.
    ///
    /// # Errors
    /// If the loop has a delay, so that the number of states is infinite, or if the loop is not well-posed because of
    /// `D`.
    pub fn complementary_sensitivity(&self) -> Result<Self, String> {
        let inverse = self.loop_inverse()?;
        Ok(Self {
            a: &self.a - &self.b * &inverse * &self.c,
            b: &self.b * &inverse,
            c: &inverse * &self.c,
            d: &inverse * &self.d,
            ..self.clone()
        })
    }

    /// Returns the sensitivity of the loop, `S = 1/(1 + L)`: from the reference to the control error.
    ///
    /// # Errors
    /// See [`StateSpace::complementary_sensitivity`].
    pub fn sensitivity(&self) -> Result<Self, String> {
        let inverse = self.loop_inverse()?;
        Ok(Self {
            a: &self.a - &self.b * &inverse * &self.c,
            b: &self.b * &inverse,
            c: -(&inverse * &self.c),
            d: inverse,
            ..self.clone()
        })
    }

    /// Returns the loop transfer function at one input while all other loops are closed by unity negative feedback,
    /// each output to the input with its index.
    ///
    /// # Errors
    /// If the system has a delay, so that the number of states is infinite, or if the closed loops are not well-posed.
    pub fn loop_at_a_time(&self, index: usize) -> Result<Self, String> {
        if self.inputs.len() == 1 && self.outputs.len() == 1 {
            return Ok(self.clone());
        }
        if self.delay != 0.0 {
            return Err(SEVERAL_DELAYED.to_owned());
        }
        let mut kept = self.clone();
        // The loop that stays open is closed with the gain 0.
        kept.c.row_mut(index).fill(0.0);
        kept.d.row_mut(index).fill(0.0);
        let inverse = kept.loop_inverse()?;
        let (c, d) = (self.c.rows(index, 1), self.d.rows(index, 1));
        let closed = Self {
            a: &self.a - &self.b * &inverse * &kept.c,
            b: &self.b * &inverse,
            c: c - d * &inverse * &kept.c,
            d: d * &inverse,
            outputs: vec![self.outputs[index].clone()],
            ..self.clone()
        };
        Ok(closed.channel(index, 0))
    }

    /// Returns `(1 + D)^-1`.
    fn loop_inverse(&self) -> Result<DMatrix<f64>, String> {
        self.check_closable()?;
        let inverse = (DMatrix::identity(self.d.nrows(), self.d.nrows()) + &self.d).try_inverse();
        inverse.ok_or_else(not_well_posed)
    }

    /// Checks that the closed loop is a system with a finite number of poles.
    fn check_closable(&self) -> Result<(), String> {
        if self.delay != 0.0 {
            return Err("a closed loop with a delay has infinitely many poles".to_owned());
        }
        if !self.d.is_square() {
            return Err("unity feedback needs as many outputs as inputs".to_owned());
        }
        Ok(())
    }
}

fn not_well_posed() -> String {
    "the loop is not well-posed: L is -1 at infinite frequency".to_owned()
}

/// Stacks two matrices vertically.
pub(super) fn above<T: Entry>(top: &DMatrix<T>, bottom: &DMatrix<T>) -> DMatrix<T> {
    let n = top.nrows();
    let entry = |i: usize, j: usize| if i < n { top[(i, j)] } else { bottom[(i - n, j)] };
    DMatrix::from_fn(n + bottom.nrows(), top.ncols(), entry)
}

/// Stacks two matrices horizontally.
pub(super) fn beside(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let mut both = DMatrix::zeros(left.nrows(), left.ncols() + right.ncols());
    both.columns_mut(0, left.ncols()).copy_from(left);
    both.columns_mut(left.ncols(), right.ncols()).copy_from(right);
    both
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TransferFunction;
    use crate::testing::{assert_same_set, c};
    use mops_math::complex;

    fn lag(gain: f64, pole: f64) -> StateSpace {
        TransferFunction::new(vec![gain], vec![1.0, pole]).state_space().unwrap()
    }

    #[test]
    fn connections_have_the_response_of_transfer_function_algebra() {
        let (f, g) = (lag(3.0, 1.0), lag(2.0, 5.0));
        let s = c(0.3, 2.0);
        let at = |system: &StateSpace| system.response().unwrap().at(s)[(0, 0)];
        let (fs, gs) = (at(&f), at(&g));
        assert!(complex::norm(at(&f.series(&g)) - fs * gs) < 1e-14);
        assert!(complex::norm(at(&f.parallel(&g).unwrap()) - (fs + gs)) < 1e-14);
        let l = f.series(&g);
        assert!(complex::norm(at(&l.complementary_sensitivity().unwrap()) - fs * gs / (fs * gs + 1.0)) < 1e-14);
        assert!(complex::norm(at(&l.sensitivity().unwrap()) - (fs * gs + 1.0).inv()) < 1e-14);
    }

    #[test]
    fn feedback_moves_the_poles_and_refuses_a_delay() {
        // 6/((s + 1)(s + 5)) in unity feedback: s^2 + 6 s + 11.
        let l = lag(3.0, 1.0).series(&lag(2.0, 5.0));
        let root = 2.0f64.sqrt();
        let closed = l.complementary_sensitivity().unwrap();
        assert_same_set(&closed.poles().unwrap(), &[c(-3.0, root), c(-3.0, -root)], 1e-13);
        assert!(closed.is_stable().unwrap());
        let late = StateSpace { delay: 0.1, ..l };
        assert!(late.complementary_sensitivity().unwrap_err().contains("delay"));
    }
}
