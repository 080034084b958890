//! Covariance of estimates, and its effect on predictions.

use nalgebra::DMatrix;

use crate::noise::{Noise, Part, Spread};
use crate::sensitivity::Sensitivity;

/// Share of a tuner's largest influence below which an entry counts as rounding error.
const ROUNDING: f64 = 1e-12;

/// Covariance of the estimates of the active tuners, to first order.
///
/// For the minimum of `r' r` over weighted residuals `r` with the Jacobian `J`:
/// ```text
/// C = A^-1 B A^-1,   A = J' J,   B = J' cov(r) J
/// ```
/// This sandwich estimator is valid for any weights, of criteria and of samples. For inverse-variance weights `A = B`,
/// up to a factor. Directions that the derivatives do not resolve are excluded.
///
/// Source: P. J. Huber, Proceedings of the Fifth Berkeley Symposium (1967) 221-233; H. White, Econometrica 48 (1980)
/// 817-838.
#[derive(Debug, Clone)]
pub struct Covariance {
    noise: Noise,
    parts: Vec<Part>,
    /// True for each tuner that is not determined.
    undetermined: Vec<bool>,
    /// Number of excluded directions.
    pub left_out: usize,
}

impl Covariance {
    /// Computes the covariance from the noise of the residuals, their Jacobian in the tuners' own units, and the
    /// resolved directions. Returns `None` if no noise level is known.
    pub(crate) fn of(noise: Noise, jacobian: &DMatrix<f64>, sensitivity: &Sensitivity) -> Option<Self> {
        let mut influence = jacobian * &sensitivity.inverse;
        for mut column in influence.column_iter_mut() {
            let least = ROUNDING * column.amax();
            column.iter_mut().filter(|value| value.abs() < least).for_each(|value| *value = 0.0);
        }
        let parts = noise.parts(&influence);
        let (undetermined, left_out) = (sensitivity.undetermined.clone(), sensitivity.unresolved());
        (noise.freedom() >= 1.0).then_some(Self { noise, parts, undetermined, left_out })
    }

    /// Returns the covariance with these tuners marked as not determined.
    pub(crate) fn without(self, undetermined: &[bool]) -> Self {
        Self { undetermined: undetermined.to_vec(), ..self }
    }

    /// Returns the spread of a quantity, given its gradient with respect to the active tuners.
    pub fn spread(&self, slopes: &[f64]) -> Spread {
        let share = |part: &Part| -> f64 {
            let row = |a: usize| (0..slopes.len()).map(|b| part.matrix[(a, b)] * slopes[b]).sum::<f64>();
            (0..slopes.len()).map(|a| slopes[a] * row(a)).sum::<f64>().max(0.0)
        };
        Spread::of_sum(self.parts.iter().map(|part| (share(part), part.pool)))
    }

    /// Returns the spread of the estimate of an active tuner, in its unit; NaN if the data do not determine it.
    pub fn of_tuner(&self, k: usize) -> Spread {
        if self.undetermined[k] {
            return Spread { deviation: f64::NAN, freedom: f64::NAN };
        }
        Spread::of_sum(self.parts.iter().map(|part| (part.matrix[(k, k)], part.pool)))
    }

    /// Returns the covariance matrix, in the tuners' own units, as far as the noise is known.
    pub(crate) fn matrix(&self) -> DMatrix<f64> {
        let n = self.parts.first().map_or(0, |part| part.matrix.nrows());
        let known = self.parts.iter().filter(|part| part.pool.variance.is_finite());
        known.fold(DMatrix::zeros(n, n), |sum, part| sum + &part.matrix * part.pool.variance)
    }

    /// Returns the noise of the residuals.
    pub fn noise(&self) -> &Noise {
        &self.noise
    }
}
