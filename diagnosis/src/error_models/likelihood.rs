//! Likelihood of independent innovations, with its gradient and the Fisher information.

use mops_language::Scalar;
use nalgebra::{DMatrix, DVector};

/// `ln(2 pi)`.
pub(super) const LN_TWO_PI: f64 = 1.837_877_066_409_345_3;

/// Log-likelihood of innovations `v` with variances `S`: the sum of `-(v^2/S + ln S + ln 2 pi)/2`.
///
/// The tangents of the scalar are those with respect to the hyperparameters of an error model. Their Fisher information
/// is the sum of `dv dv'/S + dS dS'/(2 S^2)`.
///
/// Source: F. Schweppe, IEEE Transactions on Automatic Control 11 (1965) 61 (likelihood by innovations); N. Gupta, R.
/// Mehra, IEEE Transactions on Automatic Control 19 (1974) 774 (information matrix).
#[derive(Debug, Clone)]
pub struct Likelihood<S> {
    log: S,
    information: DMatrix<f64>,
}

impl<S: Scalar> Default for Likelihood<S> {
    fn default() -> Self {
        Self { log: S::from(0.0), information: DMatrix::zeros(S::DIRECTIONS, S::DIRECTIONS) }
    }
}

impl<S: Scalar> Likelihood<S> {
    /// Adds an innovation with its variance.
    pub fn add(&mut self, innovation: S, variance: S) {
        self.log -= (innovation * innovation / variance + variance.ln() + LN_TWO_PI) * 0.5;
        let (dv, ds) = (innovation.tangents(), variance.tangents());
        let [of_innovation, of_variance] = [1.0 / variance.value(), 0.5 / (variance.value() * variance.value())];
        for a in 0..S::DIRECTIONS {
            for b in 0..S::DIRECTIONS {
                self.information[(a, b)] += dv[a] * dv[b] * of_innovation + ds[a] * ds[b] * of_variance;
            }
        }
    }

    /// Returns the logarithm of the likelihood.
    pub fn log(&self) -> f64 {
        self.log.value()
    }

    /// Returns the derivatives of [`Likelihood::log`].
    pub fn gradient(&self) -> DVector<f64> {
        DVector::from_column_slice(self.log.tangents())
    }

    /// Returns the Fisher information.
    pub fn information(&self) -> &DMatrix<f64> {
        &self.information
    }
}
