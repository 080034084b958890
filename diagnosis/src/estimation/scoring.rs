//! Maximum of a log-likelihood with bounds, by Fisher scoring.

use mops_math as math;
use nalgebra::{DMatrix, DVector};

/// Largest number of iterations of the search of hyperparameters. Basis: an assumption.
const ITERATIONS: usize = 60;

/// Predicted gain below which the search of hyperparameters ends, nats. Basis: it changes odds by a thousandth.
const FINE: f64 = 1e-3;

/// Longest step of the logarithm of a hyperparameter. Basis: the curvature, on which a step is based, changes with the
/// hyperparameter itself, here by a factor of 7.
const LONGEST_STEP: f64 = 2.0;

/// Log-likelihood at a point, with its gradient and the Fisher information.
#[derive(Debug, Clone)]
pub struct Score {
    /// Log-likelihood, plus that of the prior where there is one.
    pub log: f64,
    /// Derivatives.
    pub gradient: DVector<f64>,
    /// Fisher information, plus the precision of the prior where there is one.
    pub information: DMatrix<f64>,
}

/// Maximum within bounds.
#[derive(Debug, Clone)]
pub struct Maximum {
    /// Point.
    pub point: Vec<f64>,
    /// Score there.
    pub score: Score,
}

/// Damping, in shares of the diagonal of the information, beyond which no step can make progress.
const MOST_DAMPING: f64 = 1e9;

/// Maximises a log-likelihood of logarithms from a start, by Fisher scoring with Marquardt's damping. Coordinates at a
/// bound that the gradient presses against stay there. `None` if the likelihood is not finite at the start.
///
/// Source: D. Bertsekas, Projected Newton methods for optimization problems with simple constraints, SIAM J. Control
/// Optim. 20 (1982) 221.
pub fn maximise(start: &[f64], bounds: &[[f64; 2]], at: impl Fn(&[f64]) -> Score) -> Option<Maximum> {
    let mut point: Vec<f64> = start.iter().zip(bounds).map(|(x, b)| x.clamp(b[0], b[1])).collect();
    let mut score = at(&point);
    if !score.log.is_finite() {
        return None;
    }
    let mut damping = 1e-3;
    for _ in 0..ITERATIONS {
        let is_free = |k: &usize| {
            let (x, [low, high], slope) = (point[*k], bounds[*k], score.gradient[*k]);
            !(x <= low && slope < 0.0 || x >= high && slope > 0.0)
        };
        let free: Vec<usize> = (0..point.len()).filter(is_free).collect();
        let diagonal = |k: usize| score.information[(k, k)].max(f64::MIN_POSITIVE);
        let largest = (0..point.len()).map(diagonal).fold(0.0, f64::max);
        let damped = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            let more = if a == b { damping * diagonal(free[a]).max(1e-9 * largest) } else { 0.0 };
            score.information[(free[a], free[b])] + more
        });
        let pull = DVector::from_fn(free.len(), |a, _| score.gradient[free[a]]);
        let Some(step) = damped.cholesky().map(|factor| factor.solve(&pull)) else {
            damping *= 10.0;
            if damping > MOST_DAMPING {
                break;
            }
            continue;
        };
        let mut trial = point.clone();
        let shrink = (LONGEST_STEP / step.amax()).min(1.0);
        for (a, &k) in free.iter().enumerate() {
            trial[k] = (point[k] + shrink * step[a]).clamp(bounds[k][0], bounds[k][1]);
        }
        let moved = DVector::from_fn(point.len(), |k, _| trial[k] - point[k]);
        let predicted = score.gradient.dot(&moved) - 0.5 * moved.dot(&(&score.information * &moved));
        if predicted < FINE {
            // A step that a bound shortens need not ascend; with more damping it follows the gradient.
            let is_clipped = free.iter().enumerate().any(|(a, &k)| trial[k] != point[k] + shrink * step[a]);
            if damping > MOST_DAMPING || damping < 1.0 && !is_clipped {
                break;
            }
            damping *= 10.0;
            continue;
        }
        let there = at(&trial);
        let gain = there.log - score.log;
        if gain.is_finite() && gain > 0.0 {
            damping = if gain > 0.5 * predicted { (damping * 0.1).max(1e-9) } else { damping * 2.0 };
            (point, score) = (trial, there);
        } else {
            damping *= 10.0;
            if damping > MOST_DAMPING {
                break;
            }
        }
    }
    Some(Maximum { point, score })
}

/// Returns the logarithm of the determinant of a symmetric positive definite matrix; infinite if it is not.
pub fn log_determinant(matrix: &DMatrix<f64>) -> f64 {
    if matrix.nrows() == 0 {
        return 0.0;
    }
    // Scaled to a unit diagonal, as the unknowns are of very different sizes.
    let scale: Vec<f64> = matrix.diagonal().iter().map(|d| d.max(f64::MIN_POSITIVE).sqrt()).collect();
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |a, b| matrix[(a, b)] / (scale[a] * scale[b]));
    let Some(cholesky) = scaled.cholesky() else { return f64::INFINITY };
    let of_factor: f64 = cholesky.l_dirty().diagonal().iter().map(|l| 2.0 * math::ln(*l)).sum();
    of_factor + scale.iter().map(|s| 2.0 * math::ln(*s)).sum::<f64>()
}

#[cfg(test)]
mod tests;
