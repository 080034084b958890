//! Starting points and samples of the box.

use mops_core::{Halt, Oracle};
use mops_math::Stream;
use rand::Rng;
use rand::seq::SliceRandom;

/// Returns `start` if its simulations succeed, otherwise the best point of a sample of the box; `None` if all points
/// fail.
///
/// # Errors
/// When the run ends: budget exhausted, or interrupted by the user.
pub fn usable_start(oracle: &mut dyn Oracle, start: &[f64]) -> Result<Option<Vec<f64>>, Halt> {
    let at = oracle.evaluate(&[start.to_vec()])?.pop().expect("one point, one answer");
    if at.scaled.is_some() {
        return Ok(Some(start.to_vec()));
    }
    let mut random = oracle.stream("usable-start");
    let sample = latin_hypercube(10 * (start.len() + 1), start.len(), &mut random);
    Ok(best_of(oracle, &sample, 1)?.pop())
}

/// Returns the `count` best points of a sample that do not fail, the best last.
///
/// # Errors
/// When the run ends: budget exhausted, or interrupted by the user.
pub fn best_of(oracle: &mut dyn Oracle, sample: &[Vec<f64>], count: usize) -> Result<Vec<Vec<f64>>, Halt> {
    let mut answers = oracle.evaluate(sample)?;
    answers.retain(|answer| answer.scaled.is_some());
    let key = |merit: mops_core::Merit| (if merit.is_feasible() { 0.0 } else { merit.violation }, merit.objective);
    answers.sort_by(|a, b| key(b.merit).partial_cmp(&key(a.merit)).expect("merits of successes are finite"));
    let from = answers.len().saturating_sub(count);
    Ok(answers.drain(from..).map(|answer| answer.point).collect())
}

/// Returns `count` points of the unit box, one in each of `count` slices along every coordinate.
///
/// Source: M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239-245.
#[allow(clippy::cast_precision_loss)]
pub fn latin_hypercube(count: usize, dimension: usize, random: &mut Stream) -> Vec<Vec<f64>> {
    let mut points = vec![vec![0.0; dimension]; count];
    for j in 0..dimension {
        let mut slices: Vec<usize> = (0..count).collect();
        slices.shuffle(random);
        for (point, slice) in points.iter_mut().zip(slices) {
            point[j] = (slice as f64 + random.random::<f64>()) / count as f64;
        }
    }
    points
}
