//! Ranges of the axes.

use mops_math as math;

use mops_content::plot::Plot;

/// Returns a value, or its decimal logarithm if `log`; `None` if it cannot be drawn.
pub(super) fn drawable(value: f64, log: bool) -> Option<f64> {
    let value = if log { math::log10(value) } else { value };
    // Differences of larger values may overflow.
    (value.abs() < 1e150).then_some(value)
}

/// Returns the smallest range that contains all values, widened if they are nearly equal; `None` without values.
pub(super) fn range_of(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let [low, high] = values.map(|v| [v, v]).reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])?;
    let size = low.abs().max(high.abs());
    if high - low > 1e-9 * size {
        return Some([low, high]);
    }
    let margin = if size > 1e-100 { 0.1 * size } else { 1.0 };
    Some([low - margin, high + margin])
}

/// Returns the range of x: the window, or that of the curves.
pub(super) fn x_range(plot: &Plot) -> Option<[f64; 2]> {
    if let Some(window) = plot.window {
        return range_of(window.into_iter().filter_map(|x| drawable(x, plot.log_x)));
    }
    let xs = plot.shown().flat_map(|curve| &curve.points).map(|p| p.0).chain(plot.x_range.into_iter().flatten());
    range_of(xs.filter_map(|x| drawable(x, plot.log_x)))
}

/// Returns the range of y in the window. It contains the curves that may not leave the frame; other curves and levels
/// widen it at most to three times that range.
pub(super) fn y_range(plot: &Plot) -> Option<[f64; 2]> {
    let values = |may_leave: bool| {
        let curves = plot.shown().filter(move |c| c.may_leave == may_leave).flat_map(|c| &c.points);
        let inside = |x: f64| plot.window.map_or(x.is_finite(), |[from, to]| (from..=to).contains(&x));
        curves.filter(move |p| inside(p.0)).filter_map(|p| drawable(p.1, plot.log_y))
    };
    let bands = plot.bands.iter().flat_map(|b| b.range).filter_map(|v| drawable(v, plot.log_y));
    let [low, high] = range_of(values(false).chain(bands)).or_else(|| range_of(values(true)))?;
    let room = high - low;
    let mut range = [low, high];
    for value in values(true) {
        range = [range[0].min(value.max(low - room)), range[1].max(value.min(high + room))];
    }
    let levels = plot.levels.iter().map(|level| level.value);
    for value in levels.chain(plot.bounds.iter().flat_map(|bound| bound.y)).filter_map(|v| drawable(v, plot.log_y)) {
        if value >= low - room && value <= high + room {
            range = [range[0].min(value), range[1].max(value)];
        }
    }
    let margin = 0.05 * (range[1] - range[0]);
    Some([range[0] - margin, range[1] + margin])
}

/// Returns ranges of x and y with equal scales and a margin, for a frame with the aspect ratio `shape` (width /
/// height).
pub(super) fn equal(x: [f64; 2], y: [f64; 2], shape: f64) -> [[f64; 2]; 2] {
    let about = |[low, high]: [f64; 2], room: f64| [0.5 * (low + high - room), 0.5 * (low + high + room)];
    let height = (1.05 * (y[1] - y[0])).max(1.05 * (x[1] - x[0]) / shape);
    [about(x, height * shape), about(y, height)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_content::plot::{Curve, Level};

    #[test]
    fn equal_axes_contain_both_ranges() {
        let [x, y] = equal([-1.0, 3.0], [0.0, 1.0], 2.0);
        assert!((x[1] - x[0] - 2.0 * (y[1] - y[0])).abs() < 1e-12 && x[0] < -1.0 && y[0] < 0.0 && y[1] > 1.0);
    }

    #[test]
    fn a_curve_that_may_leave_and_a_far_level_do_not_compress_the_others() {
        let curve = |values: [f64; 2], may_leave| Curve {
            points: values.map(|v| (v, v)).to_vec(),
            may_leave,
            ..Curve::default()
        };
        let level = |value| Level { name: String::new(), value };
        let plot = Plot {
            curves: vec![curve([0.0, 1.0], false), curve([-50.0, 1e6], true)],
            levels: vec![level(1.5), level(90.0)],
            ..Plot::default()
        };
        let [low, high] = y_range(&plot).unwrap();
        assert!((low + 1.15).abs() < 1e-12 && (high - 2.15).abs() < 1e-12, "{low} {high}");
    }
}
