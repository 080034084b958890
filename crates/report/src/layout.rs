//! Layout of a plot.

use mops_content::plot::{Color, CurveStyle, Plot};

use super::axis::Axis;
use super::clip::{Frame, Point, visible};
use super::overlay::{Line, Region, lines, regions};
use super::range::{equal, x_range, y_range};
use super::scene::{ADVANCE, Anchor, LETTER, Mark, SIZE, Scene};
use super::surface::SCALE_WIDTH;

impl Scene {
    /// Lays out a plot.
    pub(super) fn of(plot: &Plot) -> Self {
        if plot.z_axis.is_some() {
            return Self::space(plot);
        }
        let mut scene = Self::default();
        let x_range = match &plot.surface {
            Some(surface) => super::surface::range(&surface.x, plot.log_x),
            None => x_range(plot),
        };
        let y_range = match &plot.surface {
            Some(surface) => super::surface::range(&surface.y, plot.log_y),
            None => y_range(plot),
        };
        let shown = [x_range.unwrap_or([0.0, 1.0]), y_range.unwrap_or([0.0, 1.0])];
        let top = scene.legend(plot, 38.0) + 12.0;
        // With margins for numbers of five letters.
        let room = [SIZE[0] - 54.0 - 5.0 * ADVANCE, SIZE[1] - 46.0 - top];
        let [x_shown, y_shown] = if plot.equal { equal(shown[0], shown[1], room[0] / room[1]) } else { shown };
        let x = x_axis(x_shown, plot.log_x);
        let y = if plot.degrees { Axis::degrees(y_shown, 7.0) } else { Axis::new(y_shown, plot.log_y, 7.0) };
        let lines = lines(plot);
        let lines: Vec<(&Line<'_>, [Point; 2])> =
            lines.iter().filter_map(|line| Some((line, part(line, &x, &y)?))).collect();
        // Names of levels, and of bounds that reach the right end.
        let at_right = lines.iter().filter(|(line, [_, end])| !line.is_vertical() && end[0] >= 1.0 - 1e-9);
        let mut names: Vec<(f64, &str)> = at_right.map(|(line, [_, end])| (end[1], line.name)).collect();
        names.sort_by(|a, b| b.0.total_cmp(&a.0));

        scene.text(&plot.title, [10.0, 16.0], Anchor::Start, Color::Text);
        let labels = longest(y.ticks.iter().map(|(_, label)| label.as_str()));
        let left = 38.0 + ADVANCE * if plot.equal { labels.max(5.0) } else { labels };
        let beside = if plot.surface.is_some() { SCALE_WIDTH } else { 0.0 };
        let right = SIZE[0] - 16.0 - beside - ADVANCE * longest(names.iter().map(|(_, name)| *name));
        let frame = Frame { from: [left, top], to: [right.max(left + 100.0), SIZE[1] - 46.0] };
        let on_frame = |at: Point| [left + at[0] * (frame.to[0] - left), frame.to[1] - at[1] * (frame.to[1] - top)];
        let place = |p: &(f64, f64)| Some(on_frame([x.position(p.0)?, y.position(p.1)?]));
        // A region for some of the curves would cover the others.
        for region in regions(plot).iter().filter(|region| region.applies_to.is_empty()) {
            let points: Vec<Point> = outline(region, &x, &y).into_iter().map(on_frame).collect();
            if !points.is_empty() {
                scene.marks.push(Mark::Area { points, color: region.color });
            }
        }
        if plot.parallel_axes.is_empty() {
            scene.axes(plot, &x, &y, frame);
        } else {
            scene.parallel_axes(&plot.parallel_axes, [&x, &y], frame);
        }
        if let Some(surface) = &plot.surface {
            scene.surface(surface, &x, &y, frame);
        }
        for curve in plot.shown() {
            let before = scene.marks.len();
            let points: Vec<Option<Point>> = curve.points.iter().map(place).collect();
            let inside = points.iter().copied().flatten().filter(|p| frame.contains(*p));
            match curve.style {
                CurveStyle::Dots => scene.dots(inside, curve.color),
                CurveStyle::Crosses => inside.for_each(|p| scene.cross(p, curve.color)),
                CurveStyle::Line | CurveStyle::Dashed => {
                    let dashed = curve.style == CurveStyle::Dashed;
                    let width = match (curve.front_point, curve.color) {
                        (Some(_), _) => 0.8,
                        (None, Color::Start | Color::Grid) => 1.3,
                        _ => 1.8,
                    };
                    for points in visible(&points, frame, 0.1) {
                        scene.marks.push(Mark::Line { points, color: curve.color, width, dashed });
                    }
                }
            }
            if let Some(point) = curve.front_point {
                let marks = scene.marks.split_off(before);
                scene.marks.push(Mark::FrontPoint { point, marks });
            }
        }
        for (line, ends) in lines {
            let [from, to] = ends.map(on_frame);
            let width = if line.dashed { 1.2 } else { 0.8 };
            scene.marks.push(Mark::Line { points: vec![from, to], color: line.color, width, dashed: line.dashed });
            if line.is_vertical() {
                scene.text(line.name, [to[0] + 4.0, to[1] + 8.0], Anchor::Start, line.name_color);
            }
        }
        let mut lowest = f64::NEG_INFINITY;
        for (at, name) in names {
            // Names of neighbouring lines must not overlap.
            lowest = on_frame([1.0, at])[1].max(lowest + 14.0);
            scene.text(name, [frame.to[0] + 6.0, lowest], Anchor::Start, Color::Demand);
        }
        if y_range.is_none() {
            let middle = [0.5 * (left + frame.to[0]), 0.5 * (top + frame.to[1])];
            scene.text("no data", middle, Anchor::Middle, Color::Faint);
        }
        scene
    }

    /// Draws grid, frame, ticks and labels of both axes.
    fn axes(&mut self, plot: &Plot, x: &Axis, y: &Axis, Frame { from, to }: Frame) {
        let line =
            |a: Point, b: Point, width| Mark::Line { points: vec![a, b], color: Color::Grid, width, dashed: false };
        for (at, label) in &x.ticks {
            let px = from[0] + at * (to[0] - from[0]);
            self.marks.push(line([px, from[1]], [px, to[1]], 0.7));
            self.text(label, [px, to[1] + 13.0], Anchor::Middle, Color::Faint);
        }
        for (at, label) in &y.ticks {
            let py = to[1] - at * (to[1] - from[1]);
            self.marks.push(line([from[0], py], [to[0], py], 0.7));
            self.text(label, [from[0] - 6.0, py], Anchor::End, Color::Faint);
        }
        let corners = vec![from, [from[0], to[1]], to];
        self.marks.push(Mark::Line { points: corners, color: Color::Faint, width: 1.0, dashed: false });
        let with_factor = |label: &str, axis: &Axis| match &axis.factor {
            Some(factor) => format!("{label} {factor}"),
            None => label.to_owned(),
        };
        self.text(
            &with_factor(&plot.x_label, x),
            [0.5 * (from[0] + to[0]), SIZE[1] - 12.0],
            Anchor::Middle,
            Color::Faint,
        );
        let at = [12.0, 0.5 * (from[1] + to[1])];
        let text = with_factor(&plot.y_label, y);
        self.marks.push(Mark::Text {
            text,
            at,
            anchor: Anchor::Middle,
            size: LETTER,
            color: Color::Faint,
            upwards: true,
        });
    }
}

/// Returns the axis along x, with fewer ticks if their labels would touch.
fn x_axis(range: [f64; 2], log: bool) -> Axis {
    let labels = |axis: &Axis| {
        ADVANCE * (longest(axis.ticks.iter().map(|(_, label)| label.as_str())) + 1.5) * axis.ticks.len() as f64
    };
    let axis = Axis::new(range, log, 8.0);
    if labels(&axis) > 0.75 * SIZE[0] { Axis::new(range, log, 4.0) } else { axis }
}

fn longest<'a>(labels: impl Iterator<Item = &'a str>) -> f64 {
    labels.map(|label| label.chars().count()).max().unwrap_or(0) as f64
}

/// Returns the position of a value, 0 at the start and 1 at the end of the axis; the edge for an infinite value.
fn position(axis: &Axis, value: f64) -> f64 {
    axis.position(value).unwrap_or(if value > 0.0 { 1.0 } else { 0.0 })
}

/// Returns the ends of the part of a line within the frame, with coordinates from 0 to 1.
fn part(line: &Line<'_>, x: &Axis, y: &Axis) -> Option<[Point; 2]> {
    let [a, b] = [0, 1].map(|i| [position(x, line.x[i]), position(y, line.y[i])]);
    let within = Frame { from: [0.0, 0.0], to: [1.0, 1.0] }.inside(a, b)?;
    Some(within.map(|s| [0, 1].map(|i| a[i] + s * (b[i] - a[i]))))
}

/// Returns the outline of the part of a region within the frame, with coordinates from 0 to 1; empty outside.
fn outline(region: &Region<'_>, x: &Axis, y: &Axis) -> Vec<Point> {
    let [start, end] = region.x.map(|value| position(x, value));
    let [from, to] = [start, end].map(|at| at.clamp(0.0, 1.0));
    if from >= to {
        return Vec::new();
    }
    let [lower, upper] = [region.lower, region.upper].map(|ends| ends.map(|value| position(y, value)));
    let height = |[a, b]: [f64; 2], at: f64| if a == b { a } else { a + (b - a) * (at - start) / (end - start) };
    // With the places where an edge enters or leaves the frame.
    let crossing = |[a, b]: [f64; 2], level: f64| start + (end - start) * (level - a) / (b - a);
    let crossings = [lower, upper].into_iter().flat_map(|edge| [0.0, 1.0].map(|level| crossing(edge, level)));
    let mut places: Vec<f64> = crossings.filter(|at| *at > from && *at < to).chain([from, to]).collect();
    places.sort_by(f64::total_cmp);
    let along = |edge: [f64; 2]| places.iter().map(move |&at| [at, height(edge, at).clamp(0.0, 1.0)]);
    if along(upper).zip(along(lower)).all(|(above, below)| above[1] <= below[1]) {
        return Vec::new();
    }
    along(upper).chain(along(lower).rev()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sloping_region_is_cut_at_the_frame_and_keeps_its_slope() {
        // The frame shows x from 5 to 15 and y from 0 to 10.
        let (x, y) = (Axis::new([5.0, 15.0], false, 5.0), Axis::new([0.0, 10.0], false, 5.0));
        let above = |lower: [f64; 2]| {
            let upper = [f64::INFINITY; 2];
            outline(&Region { x: [0.0, 10.0], lower, upper, color: Color::Excluded, applies_to: &[] }, &x, &y)
        };
        assert_eq!(above([0.0, 10.0]), [[0.0, 1.0], [0.5, 1.0], [0.5, 1.0], [0.0, 0.5]]);
        // Above the frame from its upper edge on.
        assert!(above([0.0, 20.0]).is_empty());
        // From 8 at x = 5 to 16 at x = 10, through the upper edge at x = 6.25.
        let cut = above([0.0, 16.0]);
        assert_eq!(cut, [[0.0, 1.0], [0.125, 1.0], [0.5, 1.0], [0.5, 1.0], [0.125, 1.0], [0.0, 0.8]]);
        let line = |x: [f64; 2], y: [f64; 2]| Line {
            name: "",
            x,
            y,
            color: Color::Demand,
            name_color: Color::Demand,
            dashed: true,
            applies_to: &[],
        };
        assert_eq!(part(&line([0.0, 10.0], [0.0, 16.0]), &x, &y), Some([[0.0, 0.8], [0.125, 1.0]]));
        assert_eq!(part(&line([0.0, f64::INFINITY], [5.0, 5.0]), &x, &y), Some([[0.0, 0.5], [1.0, 0.5]]));
        assert_eq!(part(&line([0.0, 5.0 - 1e-3], [1.0, 1.0]), &x, &y), None);
    }
}
