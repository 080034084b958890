//! Layout of a plot.

use mops_content::plot::{Bound, Color, CurveStyle, Plot};
use mops_core::criterion::Side;

use super::axis::Axis;
use super::clip::{Frame, Point, visible};
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
        // Labels of levels, and of bounds that reach the right end.
        let levels = plot.levels.iter().filter_map(|level| Some((y.position(level.value)?, level.name.as_str(), true)));
        let at_end = plot.bounds.iter().filter(|bound| x.position(bound.x[1]).is_none_or(|at| at >= 1.0));
        let bounds = at_end.filter_map(|bound| Some((y.position(bound.y[1])?, bound.name.as_str(), false)));
        let levels: Vec<(f64, &str, bool)> = levels.chain(bounds).filter(|(at, ..)| (0.0..=1.0).contains(at)).collect();

        scene.text(&plot.title, [10.0, 16.0], Anchor::Start, Color::Text);
        let labels = longest(y.ticks.iter().map(|(_, label)| label.as_str()));
        let left = 38.0 + ADVANCE * if plot.equal { labels.max(5.0) } else { labels };
        let beside = if plot.surface.is_some() { SCALE_WIDTH } else { 0.0 };
        let right = SIZE[0] - 16.0 - beside - ADVANCE * longest(levels.iter().map(|(_, name, _)| *name));
        let frame = Frame { from: [left, top], to: [right.max(left + 100.0), SIZE[1] - 46.0] };
        let place = |p: &(f64, f64)| {
            let (px, py) = (x.position(p.0)?, y.position(p.1)?);
            Some([left + px * (frame.to[0] - left), frame.to[1] - py * (frame.to[1] - top)])
        };
        let height = |at: f64| frame.to[1] - at.clamp(0.0, 1.0) * (frame.to[1] - top);
        let edges: Vec<Vec<Point>> = plot.bounds.iter().map(|bound| edge(bound, (&x, &y), frame)).collect();
        for (bound, edge) in plot.bounds.iter().zip(&edges) {
            // A region for some of the curves would cover the others.
            if let (Some(side), [from, .., to], true) = (bound.excluded, edge.as_slice(), bound.applies_to.is_empty()) {
                let end = if side == Side::Above { frame.from[1] } else { frame.to[1] };
                let inside = edge.iter().map(|p| [p[0], p[1].clamp(frame.from[1], frame.to[1])]);
                let points = inside.chain([[to[0], end], [from[0], end]]).collect();
                scene.marks.push(Mark::Area { points, color: Color::Excluded });
            }
        }

        for band in &plot.bands {
            if let [Some(low), Some(high)] = band.range.map(|v| y.position(v)) {
                let (from, to) = ([left, height(low.max(high))], [frame.to[0], height(low.min(high))]);
                scene.marks.push(Mark::Box { frame: Frame { from, to }, color: Color::Band });
            }
        }
        if plot.parallel_axes.is_empty() {
            scene.axes(plot, &x, &y, frame);
        } else {
            scene.parallel_axes(&plot.parallel_axes, [&x, &y], frame);
        }
        for line in &plot.verticals {
            if let Some(at) = x.position(line.value).filter(|at| (0.0..=1.0).contains(at)) {
                let px = left + at * (frame.to[0] - left);
                let points = vec![[px, top], [px, frame.to[1]]];
                scene.marks.push(Mark::Line { points, color: Color::Start, width: 0.8, dashed: false });
                scene.text(&line.name, [px + 4.0, top + 8.0], Anchor::Start, Color::Faint);
            }
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
        for edge in edges {
            let points: Vec<Option<Point>> = edge.into_iter().map(Some).collect();
            for points in visible(&points, frame, 0.1) {
                scene.marks.push(Mark::Line { points, color: Color::Demand, width: 1.2, dashed: true });
            }
        }
        let mut lowest = f64::INFINITY;
        for (at, name, is_level) in descending(levels) {
            if is_level {
                let line = vec![[left, height(at)], [frame.to[0], height(at)]];
                scene.marks.push(Mark::Line { points: line, color: Color::Demand, width: 1.2, dashed: true });
            }
            // Labels of neighbouring levels must not overlap.
            lowest = if lowest.is_finite() { height(at).max(lowest + 14.0) } else { height(at) };
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

/// Returns the line of a bound within the range of x, with points where it crosses the lower or the upper edge of the
/// frame; empty outside. Other points may lie above or below the frame.
fn edge(bound: &Bound, (x, y): (&Axis, &Axis), frame: Frame) -> Vec<Point> {
    let [Some(start), Some(end)] = bound.y.map(|value| y.position(value)) else { return Vec::new() };
    let whole = [x.position(bound.x[0]).unwrap_or(0.0), x.position(bound.x[1]).unwrap_or(1.0)];
    let [from, to] = whole.map(|at| at.clamp(0.0, 1.0));
    if from >= to {
        return Vec::new();
    }
    let height =
        |at: f64| if start == end { start } else { start + (end - start) * (at - whole[0]) / (whole[1] - whole[0]) };
    let crossing = |level: f64| whole[0] + (whole[1] - whole[0]) * (level - start) / (end - start);
    let mut places = vec![from, to];
    places.extend([0.0, 1.0].map(crossing).into_iter().filter(|at| *at > from && *at < to));
    places.sort_by(f64::total_cmp);
    let size = [frame.to[0] - frame.from[0], frame.to[1] - frame.from[1]];
    places.into_iter().map(|at| [frame.from[0] + at * size[0], frame.to[1] - height(at) * size[1]]).collect()
}

fn descending(mut levels: Vec<(f64, &str, bool)>) -> Vec<(f64, &str, bool)> {
    levels.sort_by(|a, b| b.0.total_cmp(&a.0));
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sloping_bound_is_cut_at_the_frame_and_keeps_its_slope() {
        let frame = Frame { from: [0.0, 0.0], to: [100.0, 100.0] };
        let bound =
            |y: [f64; 2]| Bound { name: String::new(), x: [0.0, 10.0], y, excluded: None, applies_to: Vec::new() };
        // The frame shows x from 5 to 15 and y from 0 to 10, the second upwards.
        let (x, y) = (Axis::new([5.0, 15.0], false, 5.0), Axis::new([0.0, 10.0], false, 5.0));
        assert_eq!(edge(&bound([0.0, 10.0]), (&x, &y), frame), [[0.0, 50.0], [50.0, 0.0]]);
        // From 10 at x = 5 to 20 at x = 10: above the frame from its upper edge on.
        assert_eq!(edge(&bound([0.0, 20.0]), (&x, &y), frame), [[0.0, 0.0], [50.0, -100.0]]);
        // From 8 at x = 5 to 16 at x = 10, through the upper edge at x = 6.25.
        assert_eq!(edge(&bound([0.0, 16.0]), (&x, &y), frame), [[0.0, 20.0], [12.5, 0.0], [50.0, -60.0]]);
        let ended = Bound { x: [0.0, 5.0], ..bound([1.0, 1.0]) };
        assert!(edge(&ended, (&x, &y), frame).is_empty());
    }
}
