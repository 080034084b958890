//! Controllability of a linear system: staircase form, indices and uncontrollable modes.

use nalgebra::DMatrix;

use super::eigen::{balance, is_moved_onto_axis};
use super::{Complex, eigenvalues};

/// Singular value, relative to the norm of the scaled system, below which an influence counts as zero.
const SMALL: f64 = 1e-12;

/// Largest number of turns to the nearest mode that the inputs do not reach. Towards a mode of multiplicity k, the
/// singular value falls by `(1 - 1/k)^k`, which is at most 1/e, so that these reach the rounding error.
const TURNS: usize = 40;

/// Ratio of the singular values of successive turns above which they do not tend to zero: above 1/e.
const FALLING: f64 = 0.7;

/// System `x' = A x + B u` with states and inputs scaled to similar magnitude, so that entries are comparable.
#[derive(Debug, Clone)]
pub(super) struct Scaled {
    /// Matrix `D^-1 A D`, for the states `z = D^-1 x`.
    pub a: DMatrix<f64>,
    /// Matrix `D^-1 B S`, for the inputs `v = S^-1 u`.
    pub b: DMatrix<f64>,
    states: Vec<f64>,
    inputs: Vec<f64>,
}

impl Scaled {
    /// Balances the system as if every state were fed back to every input.
    ///
    /// A state reached only through a chain of small influences thus gets units in which they are not small.
    pub fn of(a: &DMatrix<f64>, b: &DMatrix<f64>) -> Self {
        let (n, m) = (a.nrows(), b.ncols());
        let mut all = DMatrix::zeros(n + m, n + m);
        all.view_mut((0, 0), (n, n)).copy_from(a);
        all.view_mut((0, n), (n, m)).copy_from(b);
        all.view_mut((n, 0), (m, n)).fill(1.0);
        let scales = balance(&mut all);
        Self {
            a: all.view((0, 0), (n, n)).into_owned(),
            b: all.view((0, n), (n, m)).into_owned(),
            states: scales[..n].to_vec(),
            inputs: scales[n..].to_vec(),
        }
    }

    /// Returns `D m D` for a states x states matrix `m`.
    pub fn by_states(&self, m: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| self.states[i] * m[(i, j)] * self.states[j])
    }

    /// Returns `D^-1 m D^-1` for a states x states matrix `m`.
    pub fn per_states(&self, m: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] / self.states[i] / self.states[j])
    }

    /// Returns true if the inputs leave a mode in the closed right half-plane, or after a change of `A` and `B` by this
    /// size.
    ///
    /// The staircase loses modes that are much faster than those reached before; single modes have no such limit.
    pub fn leaves_unstable(&self, size: f64) -> Result<bool, String> {
        let modes = eigenvalues(&self.a)?;
        let unstable = modes.iter().filter(|mode| mode.re >= 0.0);
        Ok(Staircase::of(self).leaves_unstable()?
            || unstable.map(|&mode| self.left(mode, false)).any(|(left, mode)| left <= size && mode.re >= 0.0)
            || self.leaves_undamped(size)?)
    }

    /// Returns true if the inputs leave a mode on the imaginary axis after a change of `A` and `B` by this size.
    pub fn leaves_undamped(&self, size: f64) -> Result<bool, String> {
        let mut modes = eigenvalues(&self.a)?.into_iter().filter(|mode| mode.im >= 0.0);
        Ok(Staircase::of(self).leaves_undamped(size)? || modes.any(|mode| self.left(mode, true).0 <= size))
    }

    /// Returns the norm of the smallest change of `A` and `B` after which the inputs leave a mode near this one, and
    /// that mode.
    ///
    /// The norm is the smallest singular value of `[A - s, B]`, over s near the mode, or over s on the imaginary axis
    /// (Eising). In turns, a unit vector y with the least `|y^H [A - s, B]|` is sought for s, and the best s for y,
    /// which is `y^H A y`.
    ///
    /// Source: R. Eising, Between controllable and uncontrollable, Systems & Control Letters 4 (1984) 263-264.
    fn left(&self, mode: Complex, on_axis: bool) -> (f64, Complex) {
        let n = self.a.nrows();
        let a = self.a.map(|x| Complex::new(x, 0.0));
        let allowed = |s: Complex| if on_axis { Complex::new(0.0, s.im) } else { s };
        let (mut best, mut next) = ((f64::INFINITY, mode), allowed(mode));
        for _ in 0..TURNS {
            let mut both = DMatrix::zeros(n, n + self.b.ncols());
            both.view_mut((0, 0), (n, n)).copy_from(&a);
            both.view_mut((0, n), (n, self.b.ncols())).copy_from(&self.b.map(|x| Complex::new(x, 0.0)));
            (0..n).for_each(|i| both[(i, i)] -= next);
            let svd = both.svd(true, false);
            let (least, &value) =
                svd.singular_values.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)).expect("a state");
            let falls = value < FALLING * best.0;
            if value < best.0 {
                best = (value, next);
            }
            if !falls {
                break;
            }
            let y = svd.u.expect("the SVD computes U").column(least).into_owned();
            next = allowed(y.dotc(&(&a * &y)));
        }
        best
    }

    /// Returns the gain `K` of `u = -K x` that is equivalent to `v = -k z`.
    pub fn feedback(&self, k: &DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(k.nrows(), k.ncols(), |i, j| self.inputs[i] * k[(i, j)] / self.states[j])
    }
}

/// Controllability staircase: ranks of the states reached directly by the inputs, then by those states, and so on, and
/// the uncontrollable part.
///
/// Source: C. C. Paige, Properties of numerical algorithms related to computing controllability, IEEE Transactions on
/// Automatic Control 26 (1981) 130-138; A. Varga, Numerically stable algorithm for standard controllability form
/// determination, Electronics Letters 17 (1981) 74-75.
#[derive(Debug, Clone)]
pub(super) struct Staircase {
    /// Ranks of the steps, in non-increasing order.
    ranks: Vec<usize>,
    states: usize,
    /// Uncontrollable part of `A`.
    fixed: DMatrix<f64>,
}

impl Staircase {
    /// Computes the staircase of a scaled system.
    pub fn of(scaled: &Scaled) -> Self {
        let (mut a, mut b) = (scaled.a.clone(), scaled.b.clone());
        let states = a.nrows();
        let small = SMALL * a.norm().max(b.norm());
        let mut ranks = Vec::new();
        while a.nrows() > 0 {
            let n = a.nrows();
            // Padded to a square matrix, so that the left singular vectors form a complete basis.
            let mut square = DMatrix::zeros(n, n.max(b.ncols()));
            square.columns_mut(0, b.ncols()).copy_from(&b);
            let svd = square.svd(true, false);
            let rank = svd.singular_values.iter().filter(|&&s| s > small).count();
            if rank == 0 {
                break;
            }
            ranks.push(rank);
            let u = svd.u.expect("the SVD computes U");
            let turned = u.transpose() * a * u;
            b = turned.view((rank, 0), (n - rank, rank)).into_owned();
            a = turned.view((rank, rank), (n - rank, n - rank)).into_owned();
        }
        Self { ranks, states, fixed: a }
    }

    /// Returns the controllability indices, in non-increasing order: the number of states assigned to each independent
    /// input.
    pub fn indices(&self) -> Vec<usize> {
        let inputs = self.ranks.first().copied().unwrap_or(0);
        (1..=inputs).map(|i| self.ranks.iter().filter(|&&rank| rank >= i).count()).collect()
    }

    /// Returns true if the input leaves a mode in the closed right half-plane.
    fn leaves_unstable(&self) -> Result<bool, String> {
        Ok(eigenvalues(&self.fixed)?.iter().any(|mode| mode.re >= 0.0))
    }

    /// Returns true if the input leaves a mode that a change of `A` by this size moves onto the imaginary axis.
    fn leaves_undamped(&self, size: f64) -> Result<bool, String> {
        let mut modes = eigenvalues(&self.fixed)?.into_iter();
        Ok(modes.any(|mode| is_moved_onto_axis(&self.fixed, mode, size)))
    }

    /// Checks that the inputs control every state.
    ///
    /// # Errors
    /// If not, with the rank and the uncontrollable modes.
    pub fn check(&self) -> Result<(), String> {
        let rank: usize = self.ranks.iter().sum();
        if rank == self.states {
            return Ok(());
        }
        let modes = eigenvalues(&self.fixed)?.into_iter().filter(|mode| mode.im >= 0.0);
        let mut modes: Vec<String> = modes
            .map(|mode| match mode.im {
                0.0 => format!("{:.6}", mode.re),
                im => format!("{:.6} +- {im:.6}i", mode.re),
            })
            .collect();
        modes.dedup();
        Err(format!(
            "the system is not controllable: its controllability matrix has rank {rank} of {}; uncontrollable mode at {} 1/s",
            self.states,
            modes.join(" and ")
        ))
    }
}

/// Checks that the inputs control every mode.
///
/// # Errors
/// If not, with the rank and the uncontrollable modes.
pub fn check_controllable(a: &DMatrix<f64>, b: &DMatrix<f64>) -> Result<(), String> {
    Staircase::of(&Scaled::of(a, b)).check()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{furuta, random};

    #[test]
    fn the_mode_that_no_input_moves_is_named() {
        let a = DMatrix::from_row_slice(3, 3, &[-1.0, 2.0, 0.0, 0.0, -3.0, 0.0, 4.0, 5.0, -6.0]);
        let b = DMatrix::from_row_slice(3, 1, &[1.0, 0.0, 0.0]);
        let fact = check_controllable(&a, &b).unwrap_err();
        let expected = "the system is not controllable: its controllability matrix has rank 2 of 3; uncontrollable mode at \
                        -3.000000 1/s";
        assert_eq!(fact, expected);
    }

    #[test]
    fn the_pendulum_and_a_random_system_are_controllable() {
        let (a, b) = furuta();
        assert_eq!(check_controllable(&a, &b), Ok(()));
        assert_eq!(check_controllable(&random(9, 9, 1), &random(9, 1, 2)), Ok(()));
        assert!(check_controllable(&DMatrix::identity(2, 2), &random(2, 1, 3)).is_err(), "one input, a double mode");
    }

    #[test]
    fn units_of_states_and_inputs_change_no_rank() {
        // A chain of four states with influences of 1e-9 each, and one whose states have units from 1e-12 to 1e12.
        let chain = |unit: f64| DMatrix::from_fn(4, 4, |i, j| if j == i + 1 { unit } else { 0.0 });
        let last = DMatrix::from_column_slice(4, 1, &[0.0, 0.0, 0.0, 1e-20]);
        assert_eq!(check_controllable(&chain(1e-9), &last), Ok(()));
        let (mut a, mut b) = furuta();
        for (i, unit) in [1e-12, 1e12, 1e6, 1e-6].into_iter().enumerate() {
            a.row_mut(i).scale_mut(unit);
            b.row_mut(i).scale_mut(unit);
            a.column_mut(i).unscale_mut(unit);
        }
        assert_eq!(check_controllable(&a, &b), Ok(()));
    }

    #[test]
    fn the_indices_are_the_numbers_of_states_per_input() {
        // A chain of three states and one of one state: (3, 1); two of two: (2, 2).
        let indices = |lengths: &[usize]| {
            let n: usize = lengths.iter().sum();
            let (mut a, mut b) = (DMatrix::zeros(n, n), DMatrix::zeros(n, lengths.len()));
            let mut first = 0;
            for (input, &length) in lengths.iter().enumerate() {
                (first..first + length - 1).for_each(|i| a[(i, i + 1)] = 2.0);
                b[(first + length - 1, input)] = 3.0;
                first += length;
            }
            Staircase::of(&Scaled::of(&a, &b)).indices()
        };
        assert_eq!((indices(&[3, 1]), indices(&[2, 2]), indices(&[1, 4, 2])), (vec![3, 1], vec![2, 2], vec![4, 2, 1]));
    }
}
