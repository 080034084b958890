//! Declared parameters at the ends of their ranges: what the declared model explains where these are wider.

use super::fitted_set::{FittedSet, estimation, largest, rms};
use crate::estimation::{Errors, LOOK};
use crate::fit::{Fit, Point};

/// Factor by which a range is widened at an end. Basis: an order of magnitude.
const WIDER: f64 = 10.0;

/// Times that ranges are widened. Basis: two orders of magnitude are another machine.
const ROUNDS: usize = 2;

/// Ratio of the ends from which a range is one to search in: what is known better stays as it is. Basis: a factor of
/// two is the least that is looked for.
const SEARCHED: f64 = 2.0;

/// The declared model, fitted to the calibration records with wider ranges.
pub struct Widened {
    /// Parameters of the study that left their ranges, by position: the end and the value beyond it.
    pub moved: Vec<(usize, f64, f64)>,
    /// Root mean square error, noises.
    pub error: f64,
    /// Largest root mean square error of a record, noises.
    pub largest: f64,
}

impl Widened {
    /// Widens the ranges at whose ends parameters stand, and fits the declared model again; `None` if no parameter
    /// leaves its range.
    pub fn of(declared: &FittedSet<'_>) -> Option<Self> {
        let FittedSet { variant, added, .. } = declared;
        let (mut fit, mut point) = (declared.fit.clone(), declared.least_squares.point.clone());
        let subject = fit.subject;
        let first: Vec<[f64; 2]> = fit.globals.iter().map(|global| global.bounds).collect();
        let count = subject.globals.len();
        for _ in 0..ROUNDS {
            let stuck: Vec<usize> = (0..count).filter(|&k| is_stuck(&fit, &point, k)).collect();
            if stuck.is_empty() {
                break;
            }
            // Where the range ended, the other parameters had made up for it: one start is far from that corner.
            let mut beyond = point.clone();
            for &k in &stuck {
                let bounds = &mut fit.globals[k].bounds;
                let end = usize::from(point.globals[k] == bounds[1]);
                let moved = widened(bounds[end], end);
                beyond.globals[k] = bounds[end].signum() * (bounds[end] * moved).sqrt();
                bounds[end] = moved;
            }
            let near = |point: &Point| estimation(subject, &fit, variant, added, &[], point);
            let look = |from: &Point| near(from).with(&Errors::White, from.clone(), LOOK);
            let looks = [&point, &beyond].into_iter().filter_map(look);
            let best = looks.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))?.point;
            point = near(&best).least_squares(best)?.point;
        }
        let beyond = |k: usize| {
            let ([low, high], value) = (first[k], point.globals[k]);
            let end = if value < low { Some(low) } else { Some(high).filter(|high| value > *high) };
            Some((k, end?, value))
        };
        let moved: Vec<(usize, f64, f64)> = (0..count).filter_map(beyond).collect();
        let residuals = fit.all(&point).filter(|_| !moved.is_empty())?;
        Some(Self { moved, error: rms(residuals.iter().flatten()), largest: largest(&residuals) })
    }
}

/// Returns true if a parameter stands at an end of a range that is searched, other than 0.
fn is_stuck(fit: &Fit<'_>, point: &Point, k: usize) -> bool {
    let ([low, high], value) = (fit.globals[k].bounds, point.globals[k]);
    let is_searched = low <= 0.0 && high >= 0.0 || low.abs().max(high.abs()) >= SEARCHED * low.abs().min(high.abs());
    is_searched && low < high && value != 0.0 && (value == low || value == high)
}

/// Returns an end of a range, moved away from the range by [`WIDER`].
fn widened(end: f64, upper: usize) -> f64 {
    if (end > 0.0) == (upper == 1) { end * WIDER } else { end / WIDER }
}
