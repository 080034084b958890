//! Traces as points of a plot: every extremum and every jump, and enough points between them for a smooth curve.

use mops_core::Trace;

/// Number of points per trace in addition to the ends of its pieces.
const GRID: usize = 1500;
/// Number of columns of a plot; within a column only the first, lowest, highest and last point are visible.
const COLUMNS: f64 = 1000.0;

/// Returns the points of a trace for a plot.
pub fn points(trace: &Trace) -> Vec<(f64, f64)> {
    let (start, step) = (trace.start(), (trace.end() - trace.start()) / GRID as f64);
    let mut points = Vec::new();
    let mut next = 1;
    for piece in trace.pieces() {
        points.push((piece.time[0], piece.value[0]));
        while next < GRID && start + next as f64 * step < piece.time[1] {
            let time = start + next as f64 * step;
            if time > piece.time[0] {
                points.push((time, trace.at(time)));
            }
            next += 1;
        }
        points.push((piece.time[1], piece.value[1]));
    }
    thinned(points)
}

/// Reduces points with increasing x to the visible ones.
pub fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    within_columns(points, COLUMNS)
}

/// Reduces points with increasing x to at most four per column (M4). Source: U. Jugel et al., PVLDB 7 (2014) 797-808.
pub fn within_columns(points: Vec<(f64, f64)>, columns: f64) -> Vec<(f64, f64)> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return points };
    let (start, width) = (first.0, (last.0 - first.0) / columns);
    if points.len() as f64 <= 4.0 * columns || width <= 0.0 {
        return points;
    }
    let column = |p: &(f64, f64)| ((p.0 - start) / width) as i64;
    let mut kept = Vec::new();
    for group in points.chunk_by(|a, b| column(a) == column(b)) {
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let (low, high) = (group.iter().min_by(by_value), group.iter().max_by(by_value));
        let mut seen: Vec<(f64, f64)> =
            [group.first(), low, high, group.last()].into_iter().flatten().copied().collect();
        seen.sort_by(|a, b| a.0.total_cmp(&b.0));
        kept.extend(seen);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_between_the_grid_points_and_a_jump_are_kept() {
        let mut trace = Trace::starting_at(0.0, 3);
        trace.push(1.0, Trace::NODES.map(|s| 4.0 * s * (1.0 - s)));
        trace.push(1.0 + 1e-9, [7.0; 5]);
        trace.push(2.0, [3.0; 5]);
        let points = points(&trace);
        assert!(points.iter().any(|p| (p.1 - 1.0).abs() < 1e-12) && points.iter().any(|p| p.1 == 7.0));
        assert_eq!(points.last(), Some(&(2.0, 3.0)));
        assert!(super::points(&Trace::default()).is_empty());
    }

    #[test]
    fn many_points_are_thinned_without_losing_a_spike() {
        let many: Vec<(f64, f64)> = (0..100_000).map(|i| (f64::from(i), if i == 54_321 { 9.0 } else { 0.0 })).collect();
        let kept = thinned(many);
        assert!(kept.len() <= 4100 && kept.contains(&(54_321.0, 9.0)));
    }
}
