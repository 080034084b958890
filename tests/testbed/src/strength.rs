//! Magnitude at which the refitted baseline model has a given error.

use mops_math as math;

/// Sufficient relative accuracy of the error.
const CLOSE: f64 = 0.04;

/// Finds `e` within the bounds such that `error(e)` is near `size`, from below; `floor` is the error without the
/// effect.
///
/// Above the floor, the error (root difference of squares) is about proportional to the magnitude. The method is a
/// bracketed secant method in logarithms. `None` if the size is not reached, or if `error` returns `None` on the way.
pub fn find(
    (low, high): (f64, f64),
    start: f64,
    (size, floor): (f64, f64),
    mut error: impl FnMut(f64) -> Option<f64>,
) -> Option<f64> {
    let excess = |value: f64| (value * value - floor * floor).max(1e-6 * floor * floor).sqrt();
    let wanted = math::ln(excess(size));
    let mut below: Option<(f64, f64)> = None;
    let mut above: Option<(f64, f64)> = None;
    let mut e = start.clamp(low, high);
    for _ in 0..24 {
        let value = error(e);
        if let Some(value) = value {
            if (value / size - 1.0).abs() < CLOSE {
                return Some(e);
            }
            let point = (math::ln(e), math::ln(excess(value)));
            if point.1 < wanted {
                if e >= high {
                    return None;
                }
                below = Some(point);
            } else {
                above = Some(point);
            }
        } else {
            // Divergence counts as too large a magnitude.
            above = Some((math::ln(e), f64::INFINITY));
        }
        e = match (below, above) {
            (Some(b), Some(a)) => {
                if a.0 - b.0 < 1e-4 {
                    return None;
                }
                let secant = b.0 + (wanted - b.1) * (a.0 - b.0) / (a.1 - b.1);
                let margin = 0.1 * (a.0 - b.0);
                let inside = if a.1.is_finite() { secant } else { 0.5 * (a.0 + b.0) };
                math::exp(inside.clamp(b.0 + margin, a.0 - margin))
            }
            (Some(b), None) => math::exp(b.0 + (wanted - b.1).clamp(0.2, 3.0)).min(high),
            (None, Some(a)) if a.1.is_finite() => math::exp(a.0 + (wanted - a.1).clamp(-4.0, -0.2)),
            _ => e * 0.1,
        };
        if e < low {
            return None;
        }
    }
    None
}
