//! Points over three quantities, in a box that is seen from one of its upper edges; a page can turn it.

use super::axis::Axis;
use super::clip::Point;
use super::plot::{Color, Plot};
use super::range::{drawable, range_of};
use super::scene::{ADVANCE, Anchor, Mark, SIZE, Scene};
use mops_core::math;

/// A place in the box, whose sides reach from -1 to 1: along x, along y, upwards.
pub(super) type Point3 = [f64; 3];

/// From where a box is seen, in parallel projection.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// Turn about the upright axis, rad.
    pub(super) turn: f64,
    /// Height of the eye above the floor, rad.
    pub(super) height: f64,
    /// Units of the drawing for a unit of the box.
    pub(super) scale: f64,
    /// The middle of the box on the drawing.
    pub(super) middle: Point,
}

impl View {
    /// Where every picture begins: x to the right and nearer, y to the right and away, looked upon from above.
    /// N.B.: at this scale no turn takes a corner, whose distance is the root of 3, out of the picture.
    const FIRST: Self = Self { turn: -0.6, height: 0.42, scale: 70.0, middle: [0.5 * SIZE[0], 0.56 * SIZE[1]] };

    /// Where a place lies on the drawing.
    pub(super) fn project(&self, [x, y, z]: Point3) -> Point {
        let (across, depth) =
            (x * math::cos(self.turn) - y * math::sin(self.turn), x * math::sin(self.turn) + y * math::cos(self.turn));
        let up = z * math::cos(self.height) + depth * math::sin(self.height);
        [self.middle[0] + self.scale * across, self.middle[1] - self.scale * up]
    }
}

/// How far beyond the sides of the box, and how far below its floor, numbers and names of axes stand.
const NUMBERS: [f64; 2] = [1.12, 1.1];
const NAMES: [f64; 2] = [1.4, 1.35];

impl Scene {
    /// Draws the curves over x, y and the third axis; all of them are dots.
    pub(super) fn space(plot: &Plot) -> Self {
        let mut scene = Self { view: Some(View::FIRST), ..Self::default() };
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
        scene.walls();
        scene.rulers(&axes, [&plot.x_label, &plot.y_label, &z_axis.label]);
        for (curve, heights) in plot.curves.iter().zip(&z_axis.values) {
            for (&(x, y), &z) in curve.points.iter().zip(heights) {
                let at = [x, y, z];
                let on = |k: usize| axes[k].position(at[k]).map(|p| 2.0 * p - 1.0);
                let (Some(x), Some(y), Some(z)) = (on(0), on(1), on(2)) else { continue };
                // How high a dot hangs is seen by the line from it to the floor.
                scene.line_in_space([x, y, z], [x, y, -1.0], Color::Grid);
                let view = View::FIRST;
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

    /// The edges of the box.
    fn walls(&mut self) {
        for axis in 0..3 {
            for (a, b) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                let end = |along: f64| {
                    let mut place = [a, b, b];
                    place[axis] = along;
                    place[(axis + 1) % 3] = a;
                    place[(axis + 2) % 3] = b;
                    place
                };
                self.line_in_space(end(-1.0), end(1.0), Color::Grid);
            }
        }
    }

    /// Axes along three edges, with numbers and names.
    fn rulers(&mut self, axes: &[Axis; 3], names: [&String; 3]) {
        // Along x in front of the floor, along y to its right, upwards at the left.
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
            // The name of the upright axis stands above it, where there is room for it.
            let at = if k == 2 { [-1.0, -1.0, 1.2] } else { edge(k, 0.0, NAMES) };
            self.text_in_space(&name, at);
        }
    }

    fn line_in_space(&mut self, from: Point3, to: Point3, color: Color) {
        let points = [from, to].map(|place| View::FIRST.project(place)).to_vec();
        let width = if color == Color::Faint { 1.0 } else { 0.7 };
        let line = Mark::Line { points, color, width, dashed: false };
        self.marks.push(Mark::InSpace { points: vec![from, to], mark: Box::new(line) });
    }

    fn text_in_space(&mut self, text: &str, place: Point3) {
        let mut at = View::FIRST.project(place);
        // Long names stay on the paper.
        let half = 0.5 * ADVANCE * text.chars().count() as f64;
        at[0] = at[0].clamp(half.min(0.5 * SIZE[0]), (SIZE[0] - half).max(0.5 * SIZE[0]));
        let before = self.marks.len();
        self.text(text, at, Anchor::Middle, Color::Faint);
        if let Some(mark) = self.marks.get(before).cloned() {
            self.marks[before] = Mark::InSpace { points: vec![place], mark: Box::new(mark) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_turn_takes_a_corner_of_the_box_out_of_the_picture() {
        for step in 0..36 {
            for height in [0.0, 0.3, 0.6, 0.9, 1.2, std::f64::consts::FRAC_PI_2] {
                let view = View { turn: f64::from(step) * 0.175, height, ..View::FIRST };
                for corner in 0..8u8 {
                    let side = |bit: u8| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
                    let [x, y] = view.project([side(0), side(1), side(2)]);
                    assert!((0.0..=SIZE[0]).contains(&x) && (40.0..=SIZE[1]).contains(&y), "{x} {y}");
                }
            }
        }
    }

    #[test]
    fn from_above_the_floor_is_seen_as_it_is_and_from_the_side_heights_are() {
        let above = View { turn: 0.0, height: std::f64::consts::FRAC_PI_2, scale: 1.0, middle: [0.0, 0.0] };
        let side = View { height: 0.0, ..above };
        let near = |a: Point, b: Point| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-12;
        assert!(near(above.project([0.5, 0.25, 0.7]), [0.5, -0.25]));
        assert!(near(side.project([0.5, 0.25, 0.7]), [0.5, -0.7]));
    }
}
