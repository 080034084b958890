//! Sampled systems: discrete equivalents of systems with clocks.
//!
//! A sampled system is represented by its bilinear image, the system in
//!
//! ```text
//! w = 2/T (z - 1)/(z + 1)
//! ```
//!
//! with the sampling period T. The image has the same stability, and at `j 2/T tan(omega T/2)` the response of the
//! sampled system at `omega`, so that the methods for continuous systems apply exactly, and only frequencies are
//! converted.
//!
//! Source: K. J. Åström, B. Wittenmark, Computer-Controlled Systems, 3rd edition (1997), sections 2.3 (sampling), 3.2
//! (stability).

mod clock;
mod equivalent;

use equivalent::Equivalent;
use mops_math as math;
use mops_math::complex;
use nalgebra::DMatrix;

use super::components::paths;
use super::extended::Entry;
use super::extended::Real;
use super::extended::{Extended, extended, product, rounded, solved, sum};
use super::{Complex, StateSpace};
pub use clock::{Clock, NEXT, OWN};

/// Entries of a matrix that are smaller than this part of the sum of the magnitudes of their terms are rounding errors.
const ROUNDING: f64 = 1e-14;

impl StateSpace {
    /// Returns the discrete equivalent of a system with clocks, for inputs that are constant between its instants. The
    /// rows of memory in `A` and `B` are the changes at an instant of its clock.
    ///
    /// Without a cut, its instants are those of the slowest clock, or every few of them, so that all clocks repeat.
    /// Inputs change at an instant, and outputs are read after the clocks due at this instant have computed. For a cut
    /// loop, whose outputs depend on the memory of one clock only, the instants are those at which this memory changes:
    /// the outputs are read, and the inputs take their place.
    ///
    /// The last inputs are the last outputs, `delays` later (s). Each delayed quantity either changes at instants only,
    /// or acts on memory only.
    ///
    /// # Errors
    /// If the equivalent is not time-invariant or has infinitely many states, or if it has a pole at z = -1.
    ///
    /// # Panics
    /// If the system has a delay of all inputs, or fewer inputs or outputs than delays.
    pub fn sampled(&self, clocks: &[Clock], delays: &[f64], is_cut: bool) -> Result<Self, String> {
        assert!(self.delay == 0.0, "delays are those of the last inputs");
        let (difference, system) = Equivalent::new(self, clocks, delays.len()).of(delays, is_cut)?;
        bilinear(&difference, system)
    }

    /// Returns the angular frequency, rad/s, of a point `j v` of the imaginary axis; of a continuous system, `v`
    /// itself.
    pub(super) fn frequency(&self, v: f64) -> f64 {
        self.period.map_or(v, |period| 2.0 / period * math::atan(0.5 * period * v))
    }

    /// Returns the point `j v` of the imaginary axis that belongs to an angular frequency, rad/s. The response of a
    /// sampled system repeats above half of the sampling frequency.
    pub(super) fn on_axis(&self, frequency: f64) -> f64 {
        on_axis(self.period, frequency)
    }

    /// Returns the z of a pole or zero of the bilinear image; infinite for a zero at `2/T`.
    pub fn z(root: Complex, period: f64) -> Complex {
        (root * (0.5 * period) + 1.0) / (-root * (0.5 * period) + 1.0)
    }

    /// Returns `ln(z)/T`, 1/s.
    pub fn logarithm(z: Complex, period: f64) -> Complex {
        Complex::new(math::ln(complex::norm(z)), complex::arg(z)) / period
    }

    /// Returns poles or zeros of `A`, 1/s; those of a sampled system as `ln(z)/T`, without the poles and zeros at z = 0
    /// or infinity.
    pub fn in_seconds(&self, roots: Vec<Complex>) -> Vec<Complex> {
        let Some(period) = self.period else { return roots };
        let finite = roots.into_iter().map(|root| Self::logarithm(Self::z(root, period), period));
        finite.filter(|s| s.is_finite()).collect()
    }

    /// Returns the matrices of `x[k+1] = A x[k] + B u[k]`, `y[k] = C x[k] + D u[k]` of a sampled system; `None` for a
    /// continuous one.
    pub fn difference_equation(&self) -> Option<Self> {
        let half = 0.5 * self.period?;
        let n = self.order();
        let one = DMatrix::<f64>::identity(n, n);
        let inverse = (&one - &self.a * half).try_inverse()?;
        let b = &inverse * &self.b * (2.0 * half);
        let c = sum_of_products(&DMatrix::zeros(self.outputs.len(), n), &self.c, &inverse);
        let d = sum_of_products(&self.d, &c, &(&self.b * half));
        let a = without_rounding((&one + &self.a * half) * inverse);
        Some(Self { a, b, c, d, period: None, ..self.clone() })
    }
}

/// Returns the point `j v` of the imaginary axis that belongs to an angular frequency, rad/s.
pub(super) fn on_axis(period: Option<f64>, frequency: f64) -> f64 {
    period.map_or(frequency, |period| 2.0 / period * math::tan(0.5 * period * frequency))
}

/// Returns `A + B C`, with 0 for entries that are rounding errors of their terms.
fn sum_of_products(a: &DMatrix<f64>, b: &DMatrix<f64>, c: &DMatrix<f64>) -> DMatrix<f64> {
    let (sum, terms) = (a + b * c, a.abs() + b.abs() * c.abs());
    sum.zip_map(&terms, |sum, terms| if sum.abs() <= ROUNDING * terms { 0.0 } else { sum })
}

/// Sets entries to 0 that are small beside others of their row and of their column.
fn without_rounding(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let rows: Vec<f64> = matrix.row_iter().map(|row| row.amax()).collect();
    let columns: Vec<f64> = matrix.column_iter().map(|column| column.amax()).collect();
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        let entry = matrix[(i, j)];
        if entry.abs() <= 10.0 * ROUNDING * rows[i].min(columns[j]) { 0.0 } else { entry }
    })
}

/// Returns the bilinear image of a sampled system, with the given `A - 1` and the other matrices of its difference
/// equation.
///
/// Its entries are rounded once, so that zeros stay zeros, and poles that are equal, or equal to 1, stay so.
fn bilinear(difference: &DMatrix<f64>, of: StateSpace) -> Result<StateSpace, String> {
    let n = difference.nrows();
    let one = extended(&DMatrix::identity(n, n));
    let difference = extended(difference);
    let moved = sum(&difference, &one.map(|x| x.scaled(2.0)));
    let inverse = solved(moved.clone(), one);
    let inverse = inverse.ok_or("a pole of the sampled system lies at z = -1, at half of the sampling frequency")?;
    // An entry without a path from its column to its row is 0, whatever the elimination leaves of it.
    let path = paths(&moved);
    let inverse = inverse.zip_map(&path, |x, path| if path { x } else { Extended::ZERO });
    let rate = 2.0 / of.period.expect("a sampled system");
    let b = product(&inverse, &extended(&of.b));
    let direct = product(&extended(&of.c), &b).map(|x| -x);
    Ok(StateSpace {
        a: rounded(&product(&inverse, &difference)) * rate,
        d: rounded(&sum(&extended(&of.d), &direct)),
        c: rounded(&product(&extended(&of.c), &inverse)) * 2.0,
        b: rounded(&b) * rate,
        ..of
    })
}

#[cfg(test)]
mod tests;
