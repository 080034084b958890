//! Sparkline: a curve in one line of text.

use mops_math as math;

/// Block characters, from low to high.
const BLOCKS: [char; 8] =
    ['\u{2581}', '\u{2582}', '\u{2583}', '\u{2584}', '\u{2585}', '\u{2586}', '\u{2587}', '\u{2588}'];

/// Draws the best value so far over the number of evaluations, in `width` characters. `points` holds the number of
/// evaluations and the new value at each improvement. The scale is logarithmic if the values span more than a decade.
/// Columns before the first finite value are blank.
pub(super) fn sparkline(points: &[(usize, f64)], evaluations: usize, width: usize) -> String {
    let finite = || points.iter().map(|(_, value)| *value).filter(|value| value.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    let log = low > 0.0 && high > 10.0 * low;
    let height = |value: f64| {
        let [value, low, high] = [value, low, high].map(|v| if log { math::ln(v) } else { v });
        if high > low { (value - low) / (high - low) } else { 0.0 }
    };
    let letter = |column: usize| {
        // The last evaluation that this column represents.
        let until = ((column + 1) * evaluations).div_ceil(width);
        let value = points.iter().rev().find(|(at, _)| *at <= until).map(|(_, value)| *value);
        match value.filter(|value| value.is_finite()) {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            Some(value) => BLOCKS[(7.0 * height(value)).round() as usize],
            None => ' ',
        }
    };
    (0..width).map(letter).collect()
}

#[cfg(test)]
mod tests {
    use super::sparkline;

    #[test]
    fn a_curve_falls_where_the_best_point_got_better() {
        assert_eq!(sparkline(&[(1, 8.0), (50, 1.0)], 100, 4), "\u{2588}\u{2581}\u{2581}\u{2581}");
        assert_eq!(sparkline(&[(1, f64::INFINITY), (60, 3.0)], 100, 4), "  \u{2581}\u{2581}");
        // One of three decades down.
        assert_eq!(sparkline(&[(1, 1e3), (2, 1e2), (3, 1.0)], 3, 3), "\u{2588}\u{2586}\u{2581}");
        assert_eq!(sparkline(&[], 0, 3), "   ");
    }
}
