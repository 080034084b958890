//! Search for frequencies at which a response crosses a level or peaks: branch and bound over the frequency axis.
//!
//! Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis (2009), chapters 5 and 8.

use mops_math as math;

use super::Complex;
use super::bounded_response::{BoundedResponse, Span};

/// Largest number of ranges that a search evaluates: enough for a delay that turns the phase 100 000 times.
const MOST: usize = 2_000_000;

/// Change of the value over a range below which the value counts as monotone there: rad, or relative gain.
const SMOOTH: f64 = 0.3;

/// Change below which a response without a sign change counts as only touching the level.
const TOUCHING: f64 = 1e-9;

/// Relative gap between the highest gain found and its bound at which the search stops before refinement.
const SURE: f64 = 1e-6;

/// Calls `found` with every frequency, ascending, at which a value of the response crosses 0, and with true if the
/// value rises there.
///
/// `bounds` encloses the value over a range of frequencies; ranges that exclude 0 are skipped. The search stops when
/// `found` returns false.
///
/// # Errors
/// If the search exceeds its number of ranges.
pub(super) fn passes(
    of: &BoundedResponse,
    value: impl Fn(Complex) -> f64,
    bounds: impl Fn(&Span) -> [f64; 2],
    mut found: impl FnMut(f64, bool) -> bool,
) -> Result<(), String> {
    let lowest = 1e-12 * of.corners()[0];
    // A value that crosses 0 at the end of a range may lie on either side of the bounds of both neighbours.
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
        // The change is NaN where no bounds are known yet.
        if (change.is_nan() || change > touching) && span.high - span.low > 1e-13 * span.high {
            let [first, second] = span.split(of);
            open.extend([second, first]);
        }
    }
    Ok(())
}

/// Returns the highest value of the response from frequency 0 to the highest relevant one, and its frequency. The value
/// may depend on the frequency, rad/s, too.
///
/// `bounds` encloses the logarithm of the value over a range of frequencies. The remaining ranges exceed the best value
/// by at most 1e-6 (relative) and are refined.
///
/// # Errors
/// If the search exceeds its number of ranges.
pub(super) fn highest(
    of: &BoundedResponse,
    value: impl Fn(f64, Complex) -> f64,
    bounds: impl Fn(&Span) -> [f64; 2],
) -> Result<(f64, f64), String> {
    let lowest = 1e-12 * of.corners()[0];
    let at = |omega: f64| value(omega, of.at(omega));
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
        open.iter().for_each(|span| better(&mut best, value(span.center(), span.response), span.center()));
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
    // Refinement of the ranges whose bounds exceed the best value.
    tops.retain(|(most, _)| *most > best.0);
    let of_center = |span: &Span| value(span.center(), span.response);
    tops.sort_by(|a, b| of_center(&b.1).total_cmp(&of_center(&a.1)));
    for (_, span) in tops.iter().take(16) {
        let width = span.high - span.low;
        let top = maximise(at, (span.low - width).max(0.0), span.high + width);
        better(&mut best, at(top), top);
    }
    Ok(best)
}

fn too_many() -> String {
    "the frequency response turns too often to be searched: the delay is very long relative to the corner frequencies"
        .to_owned()
}

/// Returns the maximiser of a unimodal function between `low` and `high` by golden-section search.
pub(super) fn maximise(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    // Near the maximum, values differ by the square of the distance, relative to the width of the range.
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

/// Returns the point between `low` and `high` at which `f` changes its sign.
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
