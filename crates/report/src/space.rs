//! Three-dimensional plots: points in a box in parallel projection, which a page can rotate.

use mops_content::plot::{Color, Plot};

use super::axis::Axis;
use super::range::{drawable, range_of};
use super::scene::{ADVANCE, Anchor, Mark, SIZE, Scene};
use super::view::{Point3, View};

impl View {
    /// Initial view, from above: x to the right and nearer, y to the right and away.
    /// N.B.: at this scale every corner, at distance sqrt(3), stays within the drawing for any rotation.
    const INITIAL: Self = Self { azimuth: -0.6, elevation: 0.42, scale: 70.0, centre: [0.5 * SIZE[0], 0.56 * SIZE[1]] };
}

/// Distances of tick labels from the centre of the box: beyond the sides, and below the floor.
const NUMBERS: [f64; 2] = [1.12, 1.1];
/// Distances of axis names from the centre of the box: beyond the sides, and below the floor.
const NAMES: [f64; 2] = [1.4, 1.35];

impl Scene {
    /// Lays out a three-dimensional plot; all curves are dots.
    pub(super) fn space(plot: &Plot) -> Self {
        let mut scene = Self { view: Some(View::INITIAL), ..Self::default() };
        let Some(z_axis) = &plot.z_axis else { return scene };
        scene.text(&plot.title, [10.0, 16.0], Anchor::Start, Color::Text);
        scene.legend(plot, 38.0);
        let xy =
            |pick: fn(&(f64, f64)) -> f64| plot.curves.iter().flat_map(|c| &c.points).map(pick).collect::<Vec<_>>();
        let axis = |values: Vec<f64>, log: bool| {
            let range = range_of(values.into_iter().filter_map(|v| drawable(v, log)));
            Axis::new(range.unwrap_or([0.0, 1.0]), log, 3.0)
        };
        let axes = [
            axis(xy(|p| p.0), plot.log_x),
            axis(xy(|p| p.1), plot.log_y),
            axis(z_axis.values.iter().flatten().copied().collect(), false),
        ];
        scene.box_edges();
        scene.axes_in_space(&axes, [&plot.x_label, &plot.y_label, &z_axis.label]);
        for (curve, heights) in plot.curves.iter().zip(&z_axis.values) {
            for (&(x, y), &z) in curve.points.iter().zip(heights) {
                let at = [x, y, z];
                let on = |k: usize| axes[k].position(at[k]).map(|p| 2.0 * p - 1.0);
                let (Some(x), Some(y), Some(z)) = (on(0), on(1), on(2)) else { continue };
                // A line to the floor shows the height of the dot.
                scene.line_in_space([x, y, z], [x, y, -1.0], Color::Grid);
                let view = View::INITIAL;
                let dot = Mark::Dots { centres: vec![view.project([x, y, z])], color: curve.color, radius: 3.0 };
                let dot = Mark::InSpace { points: vec![[x, y, z]], mark: Box::new(dot) };
                scene.marks.push(match curve.front_point {
                    Some(point) => Mark::FrontPoint { point, marks: vec![dot] },
                    None => dot,
                });
            }
        }
        scene
    }

    /// Draws the edges of the box.
    fn box_edges(&mut self) {
        for axis in 0..3 {
            for (a, b) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                let end = |along: f64| {
                    let mut point = [a, b, b];
                    point[axis] = along;
                    point[(axis + 1) % 3] = a;
                    point[(axis + 2) % 3] = b;
                    point
                };
                self.line_in_space(end(-1.0), end(1.0), Color::Grid);
            }
        }
    }

    /// Draws axes along three edges, with tick labels and names.
    fn axes_in_space(&mut self, axes: &[Axis; 3], names: [&String; 3]) {
        // x in front of the floor, y to its right, z at the left.
        let edge = |axis: usize, along: f64, [out, below]: [f64; 2]| match axis {
            0 => [along, -out, -below],
            1 => [out, along, -below],
            _ => [-out, -1.0, along],
        };
        let on = [1.0, 1.0];
        for (k, axis) in axes.iter().enumerate() {
            self.line_in_space(edge(k, -1.0, on), edge(k, 1.0, on), Color::Faint);
            for (at, label) in &axis.ticks {
                let along = 2.0 * at - 1.0;
                self.line_in_space(edge(k, along, on), edge(k, along, [1.05, 1.0]), Color::Faint);
                self.text_in_space(label, edge(k, along, NUMBERS));
            }
            let name = match &axis.factor {
                Some(factor) => format!("{} {factor}", names[k]),
                None => names[k].clone(),
            };
            // The name of the vertical axis is above it.
            let at = if k == 2 { [-1.0, -1.0, 1.2] } else { edge(k, 0.0, NAMES) };
            self.text_in_space(&name, at);
        }
    }

    fn line_in_space(&mut self, from: Point3, to: Point3, color: Color) {
        let points = [from, to].map(|point| View::INITIAL.project(point)).to_vec();
        let width = if color == Color::Faint { 1.0 } else { 0.7 };
        let line = Mark::Line { points, color, width, dashed: false };
        self.marks.push(Mark::InSpace { points: vec![from, to], mark: Box::new(line) });
    }

    fn text_in_space(&mut self, text: &str, point: Point3) {
        let mut at = View::INITIAL.project(point);
        // Long names stay within the drawing.
        let half = 0.5 * ADVANCE * text.chars().count() as f64;
        at[0] = at[0].clamp(half.min(0.5 * SIZE[0]), (SIZE[0] - half).max(0.5 * SIZE[0]));
        let before = self.marks.len();
        self.text(text, at, Anchor::Middle, Color::Faint);
        if let Some(mark) = self.marks.get(before).cloned() {
            self.marks[before] = Mark::InSpace { points: vec![point], mark: Box::new(mark) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_corner_of_the_box_stays_within_the_drawing_for_any_rotation() {
        for step in 0..36 {
            for elevation in [0.0, 0.3, 0.6, 0.9, 1.2, std::f64::consts::FRAC_PI_2] {
                let view = View { azimuth: f64::from(step) * 0.175, elevation, ..View::INITIAL };
                for corner in 0..8u8 {
                    let side = |bit: u8| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
                    let [x, y] = view.project([side(0), side(1), side(2)]);
                    assert!((0.0..=SIZE[0]).contains(&x) && (40.0..=SIZE[1]).contains(&y), "{x} {y}");
                }
            }
        }
    }
}
