//! Frequencies at which a response does something, by dividing the axis until bounds exclude or pin it.

use super::Complex;
use super::enclosure::{Closed, Enclosure, Span};
use super::norms::maximise;

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
    of: &Enclosure,
    value: impl Fn(Complex) -> f64,
    bounds: impl Fn(&Span) -> [f64; 2],
    mut found: impl FnMut(f64, bool) -> bool,
) -> Result<(), String> {
    let lowest = 1e-12 * of.corners()[0];
    let mut open = of.spans();
    open.reverse();
    let mut looked = 0;
    while let Some(span) = open.pop() {
        looked += 1;
        if looked > MOST {
            return Err(too_many());
        }
        let [low, high] = bounds(&span);
        if low > 0.0 || high < 0.0 || span.high <= lowest {
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
        if !(change <= TOUCHING) && span.high - span.low > 1e-13 * span.high {
            let [first, second] = span.split(of);
            open.extend([second, first]);
        }
    }
    Ok(())
}

/// The highest gain of the closed loop, from frequency 0 to the highest that matters.
///
/// # Errors
/// More ranges than can be looked at.
pub(super) fn highest(of: &Enclosure, what: Closed) -> Result<f64, String> {
    let lowest = 1e-12 * of.corners()[0];
    let mut open = of.spans();
    let mut best = open.iter().map(|span| what.gain(span.response)).fold(0.0, f64::max);
    let mut tops: Vec<(f64, Span)> = Vec::new();
    let mut looked = 0;
    while !open.is_empty() {
        looked += open.len();
        if looked > MOST {
            return Err(too_many());
        }
        let mut next = Vec::new();
        for span in open {
            let here = what.gain(span.response);
            best = best.max(here);
            let most = span.closed(what)[1].exp();
            if most <= best || span.high <= lowest {
                continue;
            }
            if most <= best * (1.0 + SURE) || span.high - span.low <= 1e-13 * span.high {
                tops.push((here, span));
            } else {
                next.extend(span.split(of));
            }
        }
        open = next;
    }
    // Made exact where it may be reached.
    tops.retain(|(_, span)| span.closed(what)[1].exp() > best);
    tops.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (_, span) in tops.iter().take(16) {
        let width = span.high - span.low;
        let top = maximise(|omega| what.gain(of.at(omega)), (span.low - width).max(0.0), span.high + width);
        best = best.max(what.gain(of.at(top)));
    }
    Ok(best)
}

fn too_many() -> String {
    "the response turns too often to be searched: its delay is very long beside its corners".to_owned()
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
