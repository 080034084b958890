//! Frequencies at which a response does something, by dividing the axis until bounds exclude or pin it.
//!
//! Source (branch and bound): R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis (2009), chapters 5
//! and 8.

use super::Complex;
use super::bounded_response::{BoundedResponse, Span};
use crate::math;

/// Ranges looked at until a search counts as hopeless: a delay that turns the response a hundred thousand times.
const MOST: usize = 2_000_000;

/// Change of what is searched, over a range, below which it counts as monotone there: rad, or a share of the gain.
const SMOOTH: f64 = 0.3;

/// Change below which a response that does not pass counts as one that only touches.
const TOUCHING: f64 = 1e-9;

/// How sure a highest gain is, relative, before it is made exact.
const SURE: f64 = 1e-6;

/// Calls `found` with every frequency at which a value of the response passes 0, rising, and whether the value rises
/// there. `bounds` are those of the value over a range of frequencies; ranges that they exclude are left out. `found` may
/// end the search by `false`.
///
/// # Errors
/// More ranges than can be looked at.
pub(super) fn passes(
    of: &BoundedResponse,
    value: impl Fn(Complex) -> f64,
    bounds: impl Fn(&Span) -> [f64; 2],
    mut found: impl FnMut(f64, bool) -> bool,
) -> Result<(), String> {
    let lowest = 1e-12 * of.corners()[0];
    // A value that passes 0 at an end of a range may lie on either side of the bounds of both its neighbours.
    let inaccuracy = of.inaccuracy();
    let touching = TOUCHING.max(inaccuracy);
    let mut open = of.spans();
    open.reverse();
    let mut looked = 0;
    while let Some(span) = open.pop() {
        looked += 1;
        if looked > MOST {
            return Err(too_many());
        }
        let [low, high] = bounds(&span);
        if low > inaccuracy || high < -inaccuracy || span.high <= lowest {
            continue;
        }
        let change = high - low;
        if change <= SMOOTH {
            let at = |omega: f64| value(of.at(omega));
            let (from, to) = (at(span.low), at(span.high));
            if (from >= 0.0) != (to >= 0.0) {
                if !found(bisect(at, span.low, span.high), to >= 0.0) {
                    return Ok(());
                }
                continue;
            }
        }
        // Where nothing is known yet the change is not a number.
        if (change.is_nan() || change > touching) && span.high - span.low > 1e-13 * span.high {
            let [first, second] = span.split(of);
            open.extend([second, first]);
        }
    }
    Ok(())
}

/// The highest value of the response over all frequencies from 0 to the highest that matters, and where it is. `bounds` are
/// those of its logarithm over a range of frequencies: what they leave is at most a millionth above, and is made exact.
///
/// # Errors
/// More ranges than can be looked at.
pub(super) fn highest(
    of: &BoundedResponse,
    value: impl Fn(Complex) -> f64,
    bounds: impl Fn(&Span) -> [f64; 2],
) -> Result<(f64, f64), String> {
    let lowest = 1e-12 * of.corners()[0];
    let at = |omega: f64| value(of.at(omega));
    let start = at(0.0);
    let mut best = (if start.is_nan() { 0.0 } else { start }, 0.0);
    let better = |best: &mut (f64, f64), here: f64, omega: f64| {
        if here > best.0 {
            *best = (here, omega);
        }
    };
    let mut open = of.spans();
    let mut tops: Vec<(f64, Span)> = Vec::new();
    let mut looked = 0;
    while !open.is_empty() {
        looked += open.len();
        if looked > MOST {
            return Err(too_many());
        }
        open.iter().for_each(|span| better(&mut best, value(span.response), span.center()));
        let mut next = Vec::new();
        for span in open {
            let most = math::exp(bounds(&span)[1]);
            if most <= best.0 || span.high <= lowest {
                continue;
            }
            if most <= best.0 * (1.0 + SURE) || span.high - span.low <= 1e-13 * span.high {
                tops.push((most, span));
            } else {
                next.extend(span.split(of));
            }
        }
        open = next;
    }
    // Made exact where it may be reached.
    tops.retain(|(most, _)| *most > best.0);
    tops.sort_by(|a, b| value(b.1.response).total_cmp(&value(a.1.response)));
    for (_, span) in tops.iter().take(16) {
        let width = span.high - span.low;
        let top = maximise(at, (span.low - width).max(0.0), span.high + width);
        better(&mut best, at(top), top);
    }
    Ok(best)
}

fn too_many() -> String {
    "the response turns too often to be searched: its delay is very long beside its corners".to_owned()
}

/// The place of the maximum of a function with one maximum between `low` and `high`, by golden section.
pub(super) fn maximise(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    // Values next to the maximum differ by the square of the distance, beside the width of what is left.
    let close = (1e-6 * (high - low)).min(1e-9 * (low.abs() + high.abs()));
    let rounding = 4.0 * f64::EPSILON * (low.abs() + high.abs());
    while high - low > close.max(rounding) {
        if fa >= fb {
            (high, b, fb) = (b, a, fa);
            a = high - GOLDEN * (high - low);
            fa = f(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + GOLDEN * (high - low);
            fb = f(b);
        }
    }
    0.5 * (low + high)
}

/// Where `f` changes its sign between `low` and `high`.
pub(super) fn bisect(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let rises = f(high) >= 0.0;
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if (f(middle) >= 0.0) == rises {
            high = middle;
        } else {
            low = middle;
        }
    }
    0.5 * (low + high)
}
