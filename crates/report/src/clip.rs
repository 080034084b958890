//! Curves on the drawing: clipped at the frame and simplified.

use mops_math as math;

/// Point of the drawing: x to the right, y down.
pub(super) type Point = [f64; 2];

/// Rectangle of the drawing, by its upper left and lower right corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    pub(super) from: Point,
    pub(super) to: Point,
}

impl Frame {
    pub(super) fn contains(&self, p: Point) -> bool {
        (0..2).all(|i| p[i] >= self.from[i] - 1e-6 && p[i] <= self.to[i] + 1e-6)
    }

    /// Returns the part of a segment inside the frame, as two numbers from 0 at `a` to 1 at `b`.
    /// Source: Y.-D. Liang, B. A. Barsky, ACM Transactions on Graphics 3 (1984) 1-22.
    pub(super) fn inside(&self, a: Point, b: Point) -> Option<[f64; 2]> {
        let [mut enter, mut leave] = [0.0f64, 1.0f64];
        for i in 0..2 {
            let d = b[i] - a[i];
            if d == 0.0 {
                if a[i] < self.from[i] || a[i] > self.to[i] {
                    return None;
                }
                continue;
            }
            let (s, t) = ((self.from[i] - a[i]) / d, (self.to[i] - a[i]) / d);
            enter = enter.max(s.min(t));
            leave = leave.min(s.max(t));
        }
        (enter <= leave).then_some([enter, leave])
    }
}

/// Returns the parts of a curve inside the frame, simplified to within `tolerance`. A gap (`None`) splits the curve.
pub(super) fn visible(points: &[Option<Point>], frame: Frame, tolerance: f64) -> Vec<Vec<Point>> {
    let mut parts: Vec<Vec<Point>> = Vec::new();
    let mut joined = false;
    for pair in points.windows(2) {
        let (Some(a), Some(b)) = (pair[0], pair[1]) else {
            joined = false;
            continue;
        };
        let Some([s, t]) = frame.inside(a, b) else {
            joined = false;
            continue;
        };
        let at = |s: f64| [a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])];
        match parts.last_mut() {
            Some(part) if joined => part.push(at(t)),
            _ => parts.push(vec![at(s), at(t)]),
        }
        joined = t == 1.0;
    }
    parts.iter().map(|part| simplified(part, tolerance)).collect()
}

/// Simplifies a line to within `tolerance`. Source: D. H. Douglas, T. K. Peucker, Cartographica 10 (1973) 112-122.
pub(super) fn simplified(points: &[Point], tolerance: f64) -> Vec<Point> {
    let mut keep = vec![false; points.len()];
    let mut spans = vec![(0, points.len() - 1)];
    keep[0] = true;
    keep[points.len() - 1] = true;
    while let Some((first, last)) = spans.pop() {
        let farthest = (first + 1..last)
            .map(|i| (i, distance(points[i], points[first], points[last])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((middle, _)) = farthest.filter(|(_, d)| *d > tolerance) {
            keep[middle] = true;
            spans.extend([(first, middle), (middle, last)]);
        }
    }
    points.iter().zip(keep).filter(|(_, keep)| *keep).map(|(p, _)| *p).collect()
}

/// Returns the distance of `p` from the segment `a` to `b`.
pub(super) fn distance(p: Point, a: Point, b: Point) -> f64 {
    let (d, e) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length = d[0] * d[0] + d[1] * d[1];
    let s = if length > 0.0 { ((d[0] * e[0] + d[1] * e[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
    math::hypot(e[0] - s * d[0], e[1] - s * d[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame { from: [0.0, 0.0], to: [10.0, 10.0] };

    #[test]
    fn a_curve_is_clipped_where_it_leaves_and_enters_the_frame() {
        let curve = [[0.0, 5.0], [2.0, 5.0], [4.0, 25.0], [6.0, 5.0], [8.0, 5.0]].map(Some);
        assert_eq!(
            visible(&curve, FRAME, 0.1),
            [vec![[0.0, 5.0], [2.0, 5.0], [2.5, 10.0]], vec![[5.5, 10.0], [6.0, 5.0], [8.0, 5.0]]]
        );
        assert!(visible(&[Some([-5.0, 1.0]), Some([-1.0, 1.0])], FRAME, 0.1).is_empty());
    }

    #[test]
    fn a_gap_splits_a_curve_and_straight_lines_keep_only_their_ends() {
        let line = |i: u32| Some([f64::from(i), 1.0]);
        let curve: Vec<_> = (0..=10).map(|i| if i == 5 { None } else { line(i) }).collect();
        assert_eq!(visible(&curve, FRAME, 0.1), [[[0.0, 1.0], [4.0, 1.0]], [[6.0, 1.0], [10.0, 1.0]]]);
        assert!(visible(&[], FRAME, 0.1).is_empty() && visible(&[None, None], FRAME, 0.1).is_empty());
    }
}
