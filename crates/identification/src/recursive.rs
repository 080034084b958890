//! Recursive least squares.

use nalgebra::{DMatrix, DVector};

/// Recursive least squares with exponential forgetting: a sample has the weight `lambda^age`.
///
/// ```text
/// e        = y - phi' theta
/// P       <- (P - P phi phi' P / (lambda + phi' P phi)) / lambda
/// theta   <- theta + P phi e
/// ```
///
/// From `P = p I` and `theta = 0` the recursion minimises `sum lambda^(N - t) (y(t) - phi(t)' theta)^2 + lambda^N
/// |theta|^2 / p` exactly. With `lambda = 1` and a large `p` it agrees with [`super::least_squares`].
///
/// Source: K. J. Astrom, B. Wittenmark, Adaptive Control, 2nd edition (1995), section 2.2, theorem 2.4.
#[derive(Debug, Clone)]
pub struct Recursive {
    theta: DVector<f64>,
    p: DMatrix<f64>,
    forgetting: f64,
}

impl Recursive {
    /// Creates the recursion for `n` parameters, with forgetting factor `lambda` in (0, 1] and the initial covariance
    /// `p` I. A large `p` means no prior knowledge.
    ///
    /// # Panics
    /// If the forgetting factor is outside (0, 1].
    pub fn new(n: usize, forgetting: f64, p: f64) -> Self {
        assert!(forgetting > 0.0 && forgetting <= 1.0, "the forgetting factor must be in (0, 1]");
        Self { theta: DVector::zeros(n), p: DMatrix::identity(n, n) * p, forgetting }
    }

    /// Processes a sample: lines 2 and 3 of the recursion. Returns the prediction error.
    pub fn update(&mut self, phi: &DVector<f64>, y: f64) -> f64 {
        let error = y - phi.dot(&self.theta);
        let p_phi = &self.p * phi;
        let gain = self.forgetting + phi.dot(&p_phi);
        self.p = (&self.p - &p_phi * p_phi.transpose() / gain) / self.forgetting;
        // Restores the symmetry lost by rounding.
        self.p = (&self.p + self.p.transpose()) * 0.5;
        // P phi with the new P is P phi with the old P, divided by the gain.
        self.theta += p_phi * (error / gain);
        error
    }

    /// Returns the current estimate.
    pub fn parameters(&self) -> &[f64] {
        self.theta.as_slice()
    }

    /// Returns `P`: the covariance of the estimate divided by the noise variance.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.p
    }
}

#[cfg(test)]
mod tests {
    use mops_math as math;
    use rand::Rng;

    use super::*;
    use crate::least_squares;
    use mops_math::stream;

    fn data(rows: usize) -> (DMatrix<f64>, DVector<f64>) {
        let mut random = stream(1, "recursive");
        let regressors = DMatrix::from_fn(rows, 3, |_, _| random.random::<f64>() - 0.5);
        let noise = DVector::from_fn(rows, |_, _| 0.1 * (random.random::<f64>() - 0.5));
        let y = &regressors * DVector::from_vec(vec![2.0, -1.0, 0.5]) + noise;
        (regressors, y)
    }

    fn recursive(regressors: &DMatrix<f64>, y: &DVector<f64>, forgetting: f64, p: f64) -> Recursive {
        let mut recursive = Recursive::new(regressors.ncols(), forgetting, p);
        for (row, y) in regressors.row_iter().zip(y.iter()) {
            recursive.update(&row.transpose(), *y);
        }
        recursive
    }

    #[test]
    fn without_forgetting_it_is_least_squares() {
        let (regressors, y) = data(200);
        let batch = least_squares(&regressors, &y);
        let found = recursive(&regressors, &y, 1.0, 1e8);
        for (a, b) in found.parameters().iter().zip(&batch.parameters) {
            assert!((a - b).abs() < 1e-8, "{a} {b}");
        }
        let errors = found.covariance().diagonal().map(|p| p.sqrt() * batch.residual);
        assert!(errors.iter().zip(&batch.std_errors).all(|(a, b)| (a / b - 1.0).abs() < 1e-6), "{errors}");
    }

    #[test]
    fn with_forgetting_it_is_weighted_least_squares_and_follows_a_change() {
        let (regressors, mut y) = data(200);
        let weights = DVector::from_fn(200, |t, _| math::powi(0.95, 199 - i32::try_from(t).unwrap()).sqrt());
        let weighted = DMatrix::from_fn(200, 3, |t, k| regressors[(t, k)] * weights[t]);
        let batch = least_squares(&weighted, &y.component_mul(&weights));
        let found = recursive(&regressors, &y, 0.95, 1e8);
        assert!(found.parameters().iter().zip(&batch.parameters).all(|(a, b)| (a - b).abs() < 1e-7));
        for t in 100..200 {
            y[t] = -2.0 * regressors[(t, 0)];
        }
        let errors = |forgetting| (recursive(&regressors, &y, forgetting, 1e8).parameters()[0] + 2.0).abs();
        assert!(errors(0.9) < 1e-3 && errors(1.0) > 1.0, "{} {}", errors(0.9), errors(1.0));
    }
}
