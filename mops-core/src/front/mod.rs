//! Pareto fronts: non-dominated sorting, thinning, and quality indicators.
//!
//! Objectives are minimised and stored in one array, `m` per point. A point dominates another if it is worse in no
//! objective and better in at least one.

use mops_math as math;

mod divide;
mod hypervolume;
mod read_outs;
mod sort;

pub use hypervolume::hypervolume;
pub use read_outs::{knee, normalised, ranges};
pub use sort::FrontSorter;
pub use sort::{compare, non_dominated};

/// Returns at most `count` points, spread evenly.
///
/// The best point in every objective comes first, then repeatedly the one farthest from those selected. Each objective
/// is normalised by its range.
pub fn thinned(objectives: &[f64], m: usize, count: usize) -> Vec<usize> {
    let points = objectives.len() / m.max(1);
    if points <= count {
        return (0..points).collect();
    }
    let column = |k: usize| (0..points).map(move |i| objectives[i * m + k]);
    let ranges: Vec<f64> = (0..m)
        .map(|k| column(k).fold(f64::NEG_INFINITY, f64::max) - column(k).fold(f64::INFINITY, f64::min))
        .map(|range| if range > 0.0 { range } else { 1.0 })
        .collect();
    let least = |k: usize| (0..points).min_by(|&a, &b| objectives[a * m + k].total_cmp(&objectives[b * m + k]));
    let mut taken: Vec<usize> = Vec::with_capacity(count);
    let mut distance = vec![f64::INFINITY; points];
    let mut best = (0..m).filter_map(least);
    while taken.len() < count {
        // A point may be the best in several objectives.
        let farthest = || (0..points).reduce(|a, b| if distance[b] > distance[a] { b } else { a });
        let next = best.find(|&i| distance[i] > 0.0).or_else(farthest);
        let Some(next) = next.filter(|&i| distance[i] > 0.0) else { break };
        taken.push(next);
        for (i, distance) in distance.iter_mut().enumerate() {
            let square = |k: usize| math::powi((objectives[i * m + k] - objectives[next * m + k]) / ranges[k], 2);
            *distance = distance.min((0..m).map(square).sum());
        }
    }
    taken.sort_unstable();
    taken
}

/// Difference of every objective, relative to its range over the front, up to which two points of the front are one:
/// less matters to no designer.
pub const SAME: f64 = 1e-3;

/// Returns the points of a front of which no two are the same to within [`SAME`], in their order. The best point in
/// every objective stays.
pub fn distinct(objectives: &[f64], m: usize) -> Vec<usize> {
    let row = |i: usize| &objectives[i * m..(i + 1) * m];
    let ranges = ranges(objectives, m);
    let is_same = |a: usize, b: usize| {
        row(a).iter().zip(row(b)).zip(&ranges).all(|((a, b), [low, high])| (a - b).abs() <= SAME * (high - low))
    };
    let points = objectives.len() / m.max(1);
    let best = (0..m).filter_map(|k| (0..points).min_by(|&a, &b| row(a)[k].total_cmp(&row(b)[k])));
    let mut kept: Vec<usize> = Vec::new();
    for i in best.chain(0..points).collect::<Vec<_>>() {
        if !kept.iter().any(|&j| is_same(i, j)) {
            kept.push(i);
        }
    }
    kept.sort_unstable();
    kept
}

/// Returns the inverted generational distance: the mean distance of the points of a reference front to their nearest
/// point.
///
/// Source: C. A. Coello Coello, M. Reyes Sierra, MICAI (2004), Lecture Notes in Artificial Intelligence 2972, 688-697.
#[allow(clippy::cast_precision_loss)]
pub fn inverted_generational_distance(objectives: &[f64], m: usize, reference: &[Vec<f64>]) -> f64 {
    let nearest = |at: &Vec<f64>| {
        let square = |point: &[f64]| point.iter().zip(at).map(|(a, b)| math::powi(a - b, 2)).sum::<f64>();
        objectives.chunks_exact(m).map(square).fold(f64::INFINITY, f64::min).sqrt()
    };
    reference.iter().map(nearest).sum::<f64>() / reference.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_equal_points_one_is_kept() {
        let points = [1.0, 2.0, 2.0, 1.0, 1.0, 2.0, 3.0, 3.0];
        assert_eq!(non_dominated(&points, 2), [0, 1]);
    }

    #[test]
    fn thinning_keeps_the_ends_and_spreads_the_rest() {
        let line: Vec<f64> = (0..=100).flat_map(|i| [f64::from(i), 100.0 - f64::from(i)]).collect();
        assert_eq!(thinned(&line, 2, 3), [0, 50, 100]);
        assert_eq!(thinned(&line, 2, 5), [0, 25, 50, 75, 100]);
        assert_eq!(thinned(&line, 2, 1000).len(), 101);
    }

    #[test]
    fn a_point_that_is_the_best_in_two_objectives_does_not_end_the_thinning() {
        let points: Vec<f64> = (0..=100).flat_map(|i| [f64::from(i), f64::from(i), 100.0 - f64::from(i)]).collect();
        assert_eq!(thinned(&points, 3, 5), [0, 25, 50, 75, 100]);
    }

    #[test]
    fn the_distance_of_a_front_to_itself_is_zero() {
        let front = [0.0, 1.0, 1.0, 0.0];
        assert_eq!(inverted_generational_distance(&front, 2, &[vec![0.0, 1.0], vec![1.0, 0.0]]), 0.0);
        assert_eq!(inverted_generational_distance(&front, 2, &[vec![0.0, 2.0]]), 1.0);
    }
}
