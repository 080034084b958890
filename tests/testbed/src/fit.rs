//! Least-squares fit of the baseline model: Levenberg-Marquardt with finite differences.

use mops_math as math;

use crate::plant::{Plant, Setup};
use crate::simulate::base_outputs;

/// Measured outputs of one experiment, by output and sample.
pub type Series = Vec<Vec<f64>>;

/// Integration steps per sample of the baseline model in fits.
const STEPS: usize = 2;

/// Result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Parameters.
    pub parameters: Vec<f64>,
    /// Initial states.
    pub start: Vec<f64>,
    /// `sqrt(mean over samples and outputs of ((y - yhat)/noise)^2)`.
    pub error: f64,
}

/// Fits the logarithms of the (positive) parameters and the initial states to one experiment.
///
/// `noise` is the standard deviation of each output, `from` the initial guess. `None` if the model diverges at the
/// initial guess.
pub fn fit(plant: &Plant, setup: &Setup, measured: &Series, noise: &[f64], from: (&[f64], &[f64])) -> Option<Fit> {
    // The memory of a controller is known at the start.
    let (free, memory) = from.1.split_at(plant.continuous());
    let (np, nx) = (from.0.len(), free.len());
    let n = np + nx;
    let mut at: Vec<f64> = from.0.iter().map(|p| math::ln(*p)).chain(free.iter().copied()).collect();
    let residual = |at: &[f64]| -> Option<Vec<f64>> {
        let p: Vec<f64> = at[..np].iter().map(|p| math::exp(*p)).collect();
        let start = [&at[np..], memory].concat();
        let y = base_outputs(plant, &p, &start, setup, STEPS)?;
        let weighted = y.iter().zip(measured).zip(noise);
        let r: Vec<f64> = weighted.flat_map(|((y, m), s)| y.iter().zip(m).map(move |(y, m)| (y - m) / s)).collect();
        r.iter().all(|v| v.is_finite()).then_some(r)
    };
    let cost = |r: &[f64]| r.iter().map(|v| v * v).sum::<f64>();
    let mut r = residual(&at)?;
    let mut best = cost(&r);
    let mut damping = 1e-4;
    for _ in 0..25 {
        // Finite differences; steps are small compared with the resolution of the noise and large compared with
        // rounding errors.
        let mut slopes = Vec::with_capacity(n);
        for j in 0..n {
            let step = 1e-6 * if j < np { 1.0 } else { at[j].abs().max(0.1) };
            let mut moved = at.clone();
            moved[j] += step;
            let ahead = residual(&moved)?;
            slopes.push(ahead.iter().zip(&r).map(|(a, b)| (a - b) / step).collect::<Vec<f64>>());
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let square: Vec<Vec<f64>> = slopes.iter().map(|a| slopes.iter().map(|b| dot(a, b)).collect()).collect();
        let gradient: Vec<f64> = slopes.iter().map(|a| -dot(a, &r)).collect();
        let before = best;
        for _ in 0..8 {
            let Some(step) = solve(&square, &gradient, damping) else {
                damping *= 10.0;
                continue;
            };
            // The linearisation is trusted for changes of a parameter by up to a factor of 2.
            let longest = step[..np].iter().fold(0.0_f64, |m, s| m.max(s.abs()));
            let short = (0.7 / longest).min(1.0);
            let next: Vec<f64> = at.iter().zip(&step).map(|(a, s)| a + short * s).collect();
            match residual(&next).map(|r| (cost(&r), r)) {
                Some((value, ahead)) if value < best => {
                    (at, r, best) = (next, ahead, value);
                    damping = (damping * 0.1).max(1e-12);
                    break;
                }
                _ => damping = (damping * 10.0).max(1e-8),
            }
        }
        if before - best < 1e-5 * before {
            break;
        }
    }
    let parameters = at[..np].iter().map(|p| math::exp(*p)).collect();
    Some(Fit { parameters, start: [&at[np..], memory].concat(), error: (best / r.len() as f64).sqrt() })
}

/// Solves `(A + damping diag(A)) x = b` by Cholesky in units of the diagonal; `None` if the matrix is not positive
/// definite.
fn solve(a: &[Vec<f64>], b: &[f64], damping: f64) -> Option<Vec<f64>> {
    let n = b.len();
    let unit: Vec<f64> = (0..n).map(|i| a[i][i].sqrt().max(1e-150)).collect();
    let mut l = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let diagonal = if i == j { 1.0 + damping + 1e-13 } else { a[i][j] / (unit[i] * unit[j]) };
            let rest = diagonal - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            if i == j {
                if rest <= 0.0 {
                    return None;
                }
                l[i][i] = rest.sqrt();
            } else {
                l[i][j] = rest / l[j][j];
            }
        }
    }
    let mut x = vec![0.0; n];
    for i in 0..n {
        x[i] = (b[i] / unit[i] - (0..i).map(|k| l[i][k] * x[k]).sum::<f64>()) / l[i][i];
    }
    for i in (0..n).rev() {
        x[i] = (x[i] - (i + 1..n).map(|k| l[k][i] * x[k]).sum::<f64>()) / l[i][i];
    }
    Some(x.iter().zip(&unit).map(|(x, u)| x / u).collect())
}
