//! Definition of problems with known fronts.

use mops_core::front::{hypervolume, non_dominated};
use mops_language::Dual7;

use crate::{Answer, Functions, Problem, Sense};

/// Plain generic function, for each kind of number.
pub(super) type Plain = (fn(&[f64]) -> Vec<f64>, fn(&[Dual7]) -> Vec<Dual7>);

/// Points of a front.
pub(super) type Points = fn(usize) -> Vec<Vec<f64>>;

/// Creates a problem over its bounds, with the initial guess at their centre.
pub(super) fn problem(name: &str, bounds: Vec<[f64; 2]>, functions: Plain, front: Answer) -> Problem {
    let start: Vec<f64> = bounds.iter().map(|[low, high]| 0.5 * (low + high)).collect();
    Problem { sense: Sense::Each, bounds, ..Problem::new(name, &start, front, Functions::of(functions.0, functions.1)) }
}

/// Creates a front of known hypervolume.
pub(super) fn known(reference: &[f64], hypervolume: f64, points: Points) -> Answer {
    Answer::Front { reference: reference.to_vec(), hypervolume, points }
}

/// Creates a front whose hypervolume is that of many of its points.
pub(super) fn sampled(reference: &[f64], count: usize, points: Points) -> Answer {
    known(reference, hypervolume(&points(count).concat(), reference), points)
}

/// Returns the non-dominated points.
pub(super) fn best_of(points: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let m = points.first().map_or(0, Vec::len);
    non_dominated(&points.concat(), m).into_iter().map(|i| points[i].clone()).collect()
}

/// Returns `count` equidistant numbers from `low` to `high`.
#[allow(clippy::cast_precision_loss)]
pub(super) fn evenly(low: f64, high: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| low + (high - low) * i as f64 / (count.max(2) - 1) as f64)
}
