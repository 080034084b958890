//! Surface plots: values as colours, with contour lines and a colour scale.

use mops_content::{
    contour::{along, contour},
    plot::{Color, Surface},
};

use super::axis::Axis;
use super::clip::Frame;
use super::range::{drawable, range_of};
use super::scene::{Anchor, Mark, Scene};

/// Width of the colour scale to the right of the frame.
pub(super) const SCALE_WIDTH: f64 = 84.0;

/// Number of colours.
const COLORS: usize = 32;
/// Number of intervals between contour lines.
const LINES: usize = 8;

/// Quantile of the values at which the colour scale ends. Values above it have the same colour, as large values next to
/// a failure would compress the scale.
const HIGHEST: f64 = 0.9;
/// Largest number of decades of a logarithmic colour scale.
const DECADES: f64 = 4.0;

/// Red, green and blue of the colour scale, from low to high values. Lightness increases evenly, also for colour-blind
/// readers.
/// Source: S. van der Walt, N. Smith, viridis, Matplotlib 1.5 (2015), every 32nd colour.
const VIRIDIS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 44.0, 122.0],
    [59.0, 81.0, 139.0],
    [44.0, 113.0, 142.0],
    [33.0, 144.0, 141.0],
    [39.0, 173.0, 129.0],
    [92.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// Returns the colour of a height from 0 to 1.
fn viridis(height: f64) -> [u8; 3] {
    let at = height.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let i = (at as usize).min(VIRIDIS.len() - 2);
    let s = at - i as f64;
    std::array::from_fn(|k| (VIRIDIS[i][k] + s * (VIRIDIS[i + 1][k] - VIRIDIS[i][k])).round() as u8)
}

/// Returns the range of a coordinate, or of its logarithm.
pub(super) fn range(values: &[f64], log: bool) -> Option<[f64; 2]> {
    range_of(values.iter().filter_map(|&v| drawable(v, log)))
}

/// Returns the range of the colour scale: of the values, or of their logarithms.
fn heights(surface: &Surface) -> Option<[f64; 2]> {
    let mut all: Vec<f64> = surface.values.iter().flatten().filter_map(|&v| drawable(v, surface.log)).collect();
    all.sort_by(f64::total_cmp);
    let high = all.get(((all.len() as f64 * HIGHEST) as usize).min(all.len().saturating_sub(1)))?;
    let high = if surface.log { high.min(all[0] + DECADES) } else { *high };
    range_of([all[0], high].into_iter())
}

impl Scene {
    /// Draws the surface into the frame, and its colour scale to the right.
    pub(super) fn surface(&mut self, surface: &Surface, x: &Axis, y: &Axis, frame: Frame) {
        let Some([low, high]) = heights(surface) else { return };
        let Frame { from: [left, top], to: [right, bottom] } = frame;
        let height = |value: f64| drawable(value, surface.log).map(|v| ((v - low) / (high - low)).clamp(0.0, 1.0));
        let band = |value: f64| height(value).map(|h| ((h * COLORS as f64) as usize).min(COLORS - 1));
        let xs: Vec<f64> = surface.x.iter().map(|&v| left + x.position(v).unwrap_or(0.0) * (right - left)).collect();
        let ys: Vec<f64> = surface.y.iter().map(|&v| bottom - y.position(v).unwrap_or(0.0) * (bottom - top)).collect();
        let edges = |at: &[f64], i: usize| {
            let between = |i: usize, j: usize| 0.5 * (at[i] + at[j]);
            let before = if i == 0 { at[0] } else { between(i - 1, i) };
            let after = if i + 1 == at.len() { at[i] } else { between(i, i + 1) };
            [before.min(after), before.max(after)]
        };
        for (r, row) in surface.values.iter().enumerate() {
            let [upper, lower] = edges(&ys, r);
            let mut c = 0;
            while c < row.len() {
                // Neighbours of equal colour are merged into one box.
                let of = band(row[c]);
                let end = (c..row.len()).find(|&k| band(row[k]) != of).unwrap_or(row.len());
                if let Some(of) = of {
                    let box_ = Frame { from: [edges(&xs, c)[0], upper], to: [edges(&xs, end - 1)[1], lower] };
                    self.marks.push(Mark::Cell { frame: box_, rgb: viridis((of as f64 + 0.5) / COLORS as f64) });
                }
                c = end;
            }
        }
        let raised: Vec<Vec<f64>> =
            surface.values.iter().map(|row| row.iter().map(|&v| height(v).unwrap_or(f64::NAN)).collect()).collect();
        for line in 1..LINES {
            for segment in contour(&raised, line as f64 / LINES as f64) {
                let points = segment.map(|p| [along(&xs, p[0]), along(&ys, p[1])]).to_vec();
                self.marks.push(Mark::Line { points, color: Color::Faint, width: 0.7, dashed: false });
            }
        }
        self.scale(surface, [low, high], frame);
    }

    fn scale(&mut self, surface: &Surface, range: [f64; 2], Frame { from: [_, top], to: [right, bottom] }: Frame) {
        let at = |share: f64| bottom - share * (bottom - top);
        let [left, end] = [right + 14.0, right + 26.0];
        for i in 0..COLORS {
            let [from, to] = [i, i + 1].map(|i| at(i as f64 / COLORS as f64));
            let frame = Frame { from: [left, to], to: [end, from] };
            self.marks.push(Mark::Cell { frame, rgb: viridis((i as f64 + 0.5) / COLORS as f64) });
        }
        let axis = Axis::new(range, surface.log, 6.0);
        for (share, label) in &axis.ticks {
            self.text(label, [end + 5.0, at(*share)], Anchor::Start, Color::Faint);
        }
        let factor = axis.factor.as_deref().map_or_else(String::new, |factor| format!(" {factor}"));
        let label = format!("{}{factor}", surface.label);
        self.text(&label, [right + SCALE_WIDTH - 4.0, top - 14.0], Anchor::End, Color::Faint);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Draw;
    use super::*;
    use mops_content::plot::Plot;

    fn surface(values: Vec<Vec<f64>>) -> Plot {
        let axis = |n: usize| (0..n).map(|i| i as f64).collect();
        let (x, y) = (axis(values[0].len()), axis(values.len()));
        Plot { surface: Some(Surface { x, y, values, ..Surface::default() }), ..Plot::default() }
    }

    #[test]
    fn failed_points_are_left_blank_and_one_high_point_does_not_compress_the_scale() {
        let mut values: Vec<Vec<f64>> = (0..10).map(|r| (0..10).map(|c| f64::from(r * c)).collect()).collect();
        values[9][9] = 1e9;
        values[0][0] = f64::NAN;
        let plot = surface(values);
        let [low, high] = heights(plot.surface.as_ref().unwrap()).unwrap();
        assert!(low == 0.0 && high < 82.0, "{low} {high}");
        let svg = plot.svg();
        assert!(!svg.contains("NaN") && svg.contains("#440154") | svg.contains("crispEdges"));
    }

    #[test]
    fn surfaces_without_a_value_and_flat_ones_are_drawn() {
        for value in [f64::NAN, 0.0, 3.0, -1.0] {
            let svg = surface(vec![vec![value; 3]; 3]).svg();
            assert!(svg.starts_with("<svg") && !svg.contains("NaN"), "{value}");
        }
    }
}
