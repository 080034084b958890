//! Covariance of estimates, and what it makes of predictions.

use nalgebra::{DMatrix, SymmetricEigen};

use super::insight::local;
use crate::problem::Problem;

/// What the data tell of the uncertainty of the active tuners, to first order.
#[derive(Debug, Clone)]
pub struct Covariance {
    /// `s^2 (J' J)^-1` in the tuners' own units, over the directions that the data determine.
    pub matrix: DMatrix<f64>,
    /// `s`: standard deviation of the weighted residuals per degree of freedom.
    pub deviation: f64,
    /// Residuals less directions that are determined.
    pub freedom: usize,
    /// Number of directions that the data do not determine; they are left out of the matrix.
    pub undetermined: usize,
}

impl Covariance {
    /// At given values of all tuners; `None` where nothing is measured, no slope can be had, or residuals are too few.
    pub fn at(problem: &Problem, tuners: &[f64]) -> Option<Self> {
        let local = local(problem, tuners, problem.study().tasks.sensitivity.zero)?;
        let (rank, n) = (local.sensitivity.rank, problem.active().len());
        let freedom = problem.shape().residuals.checked_sub(rank).filter(|&f| f > 0)?;
        if !local.deviation.is_finite() {
            return None;
        }
        let information = &local.sensitivity.matrix;
        // Of unit diagonal, so that no choice of units matters.
        let scale: Vec<f64> = (0..n)
            .map(|k| if information[(k, k)] > 0.0 { information[(k, k)].sqrt() } else { f64::INFINITY })
            .collect();
        let unit = DMatrix::from_fn(n, n, |a, b| information[(a, b)] / (scale[a] * scale[b]));
        let eigen = SymmetricEigen::new(unit);
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
        let deviation = local.deviation;
        let matrix = DMatrix::from_fn(n, n, |a, b| {
            let part = |&i: &usize| eigen.eigenvectors[(a, i)] * eigen.eigenvectors[(b, i)] / eigen.eigenvalues[i];
            deviation.powi(2) * order[..rank].iter().map(part).sum::<f64>() / (scale[a] * scale[b])
        });
        Some(Self { matrix, deviation, freedom, undetermined: n - rank })
    }

    /// Standard deviation of a quantity with these slopes along the active tuners.
    pub fn of(&self, slopes: &[f64]) -> f64 {
        let variance: f64 = (0..slopes.len())
            .map(|a| (0..slopes.len()).map(|b| slopes[a] * self.matrix[(a, b)] * slopes[b]).sum::<f64>())
            .sum();
        variance.max(0.0).sqrt()
    }
}
