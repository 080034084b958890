//! Intervals of fitted unknowns by the profile of the sum of squares.

use crate::fit::{Fit, Fitted, Point};
use mops_core::math;

/// Standard normal quantile at 0.975.
pub const QUANTILE: f64 = 1.959_964;

/// How near to the quantile an end of an interval is.
const NEAR: f64 = 0.02;

/// Fits for an end of an interval.
const FITS: usize = 8;

/// Iterations of each: a short fit, in which sizes of steps are looked for briefly.
const ITERATIONS: usize = 9;

/// How many times farther the next fit is at most where an end is not yet in sight.
const FARTHER: f64 = 3.0;

/// Farthest end of an unknown on a logarithmic scale, as a logarithm.
const MOST: f64 = 14.0;

/// What was fitted with the unknown held: how far away, in standard errors, the profile t there, and the point.
struct Held {
    away: f64,
    t: f64,
    point: Point,
}

/// The 95 % interval of the global `k`: where the sum of squares, all other unknowns fitted anew, rises by the quantile of
/// chi-squared, `weight` units of it counted as one; but not nearer than the linearised one ends, in the logarithm where the
/// unknown has a logarithmic scale. `error` is the standard error with which the search begins; an end that is not found lies at
/// the bound, or where the search ended.
///
/// Source: D. M. Bates, D. G. Watts, Nonlinear Regression Analysis and Its Applications (Wiley 1988), section 6.1: the profile
/// t function, right also where the sum of squares is far from a parabola.
pub fn interval95(fit: &Fit<'_>, fitted: &Fitted, k: usize, error: f64, weight: f64) -> [f64; 2] {
    [-1.0, 1.0].map(|side| end(fit, fitted, k, side * error, weight))
}

/// The end in the direction of `step`, a standard error.
fn end(fit: &Fit<'_>, fitted: &Fitted, k: usize, step: f64, weight: f64) -> f64 {
    let global = fit.globals[k];
    let value = fitted.point.globals[k];
    let least = fit.total(fitted);
    let place = |away: f64| {
        let place =
            if global.log { value * math::exp((away * step / value).clamp(-MOST, MOST)) } else { value + away * step };
        place.clamp(global.bounds[0], global.bounds[1])
    };
    let mut held = fit.clone();
    let mut at = |from: &Point, away: f64| -> Option<Held> {
        let mut start = from.clone();
        start.globals[k] = place(away);
        held.globals[k].bounds = [start.globals[k]; 2];
        let found = held.solve(start, ITERATIONS)?;
        let rise = (held.total(&found) - least).max(0.0);
        Some(Held { away, t: (rise / weight).sqrt(), point: found.point })
    };
    let mut inner = Held { away: 0.0, t: 0.0, point: fitted.point.clone() };
    let mut outer: Option<(f64, f64)> = None;
    let mut away = QUANTILE;
    for _ in 0..FITS {
        match at(&inner.point, away) {
            Some(found) if (found.t - QUANTILE).abs() < NEAR => return place(away),
            Some(found) if found.t < QUANTILE => {
                if place(away) == global.bounds[0] || place(away) == global.bounds[1] {
                    return place(away);
                }
                inner = found;
            }
            // A fit that stops early, or cannot be simulated, does not tell that the end is nearer than the linear one.
            _ if away == QUANTILE => return place(away),
            Some(found) => outer = Some((found.away, found.t)),
            None => outer = Some((away, f64::INFINITY)),
        }
        away = match outer {
            None => inner.away * (QUANTILE / inner.t).clamp(1.0 + NEAR, FARTHER),
            Some((far, t)) => {
                let share = (QUANTILE - inner.t) / (t - inner.t);
                let share = if t.is_finite() { share.clamp(0.1, 0.9) } else { 0.5 };
                inner.away + share * (far - inner.away)
            }
        };
    }
    place(inner.away)
}
