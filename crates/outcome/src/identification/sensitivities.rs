//! Report on the sensitivities of a problem's tuners at a point.

use mops_core::{evaluation::Evaluation, problem::Problem, solver::SMALL_OBJECTIVE};
use mops_identification::{
    Coordinate, Local, NEGLIGIBLE, Point, blind::BlindDirection, counting, local, sensitivity::Eigen,
};
use mops_math as math;
use nalgebra::DMatrix;

use super::directions::{at_point, clause, suffix, sum};
use super::report::{DirectionReport, RelativeReport, SensitivityReport, TunerSensitivity};
use super::sentences::sentences;

/// Relative standard error up to which an estimate counts as determined.
const TRUSTED: f64 = 0.1;

/// Returns the sensitivity report on the active tuners at given values of all tuners.
///
/// `zero` replaces the default share of the largest singular value that the derivatives still resolve.
pub fn sensitivity_at(problem: &Problem, tuners: &[f64], point: Point, zero: Option<f64>) -> Option<SensitivityReport> {
    let local = local(problem, tuners, point, zero)?;
    Some(report_of(problem, tuners, &local))
}

/// Returns the report on computed sensitivities.
pub(crate) fn report_of(problem: &Problem, at: &[f64], local: &Local) -> SensitivityReport {
    let found = &local.sensitivity;
    let directions: Vec<DirectionReport> = found
        .blind
        .iter()
        .map(|blind| {
            let along = |straight: bool| remaining(problem, at, (blind, straight), &found.coordinates);
            let is_straight = blind.invariant.is_straight();
            let step = along(is_straight);
            // A sum and a product of two tuners may have the same direction at a point: a step decides.
            let sum = if is_straight { None } else { sum(blind, &found.coordinates) };
            let sum = sum.map(|words| (words, along(true))).filter(|(_, of)| of.remaining < step.remaining);
            let (words, step) = sum.unwrap_or_else(|| (clause(blind, &found.coordinates), step));
            let has_effect = !local.residuals && step.has_effect;
            DirectionReport {
                words: if has_effect {
                    at_point(blind, &found.coordinates)
                } else {
                    format!("{words}{}", suffix(blind.limit))
                },
                changes: blind.changes.iter().map(|&(k, c)| (found.coordinates[k].name.clone(), c)).collect(),
                remaining: step.remaining,
                has_effect,
            }
        })
        .collect();
    let tuners: Vec<TunerSensitivity> = (0..found.coordinates.len()).map(|k| tuner(local, k)).collect();
    let split = |eigen: &Eigen| -> (Vec<f64>, Vec<Vec<f64>>) { eigen.iter().cloned().unzip() };
    let (eigenvalues, eigenvectors) = split(&found.own);
    let (relative_values, relative_vectors) = split(&found.relative);
    let rows = |m: &DMatrix<f64>| m.row_iter().map(|row| row.iter().copied().collect()).collect();
    SensitivityReport {
        words: sentences(problem, local, &tuners, &directions),
        slopes: if local.exact { "tangents" } else { "differences" },
        of: if local.residuals { "residuals" } else { "criteria" },
        rank: found.rank,
        singular_values: found.singular_values.clone(),
        zero: found.zero,
        tuners,
        matrix: rows(&found.matrix),
        eigenvalues,
        eigenvectors,
        relative: RelativeReport {
            scales: found.coordinates.iter().map(Coordinate::scale).collect(),
            eigenvalues: relative_values,
            eigenvectors: relative_vectors,
        },
        directions,
        correlations: rows(&found.correlation),
    }
}

fn tuner(local: &Local, k: usize) -> TunerSensitivity {
    let found = &local.sensitivity;
    let coordinate = &found.coordinates[k];
    let [alone, together] = [found.alone[k], found.together[k]];
    let std_error = local.spread(k).deviation;
    // An initial state may be near zero, so its error is related to its range.
    let by_range = local.starts[k] || coordinate.is_by_range();
    let scale = if by_range { coordinate.range } else { coordinate.scale() };
    let relative_error = std_error / scale;
    TunerSensitivity {
        name: coordinate.name.clone(),
        value: coordinate.value,
        unit: coordinate.unit.clone(),
        effect: coordinate.scale() / alone,
        std_error,
        std_error_alone: local.alone[k],
        relative_error,
        relative_to: if by_range { "range" } else { "value" },
        inflation: together / alone,
        trust: match relative_error {
            _ if found.undetermined[k] => "undetermined",
            error if error > TRUSTED => "weak",
            _ => "determined",
        },
    }
}

/// Change for a 10 % step along a blind direction.
struct Step {
    /// Change relative to steps of the single tuners.
    remaining: f64,
    /// True if a criterion changes by more than is negligible.
    has_effect: bool,
}

/// Returns the remaining change of the residuals for a 10 % step along a blind direction, relative to steps of its
/// single tuners. The step is straight in the tuners, or in their logarithms.
fn remaining(
    problem: &Problem,
    at: &[f64],
    (blind, straight): (&BlindDirection, bool),
    coordinates: &[Coordinate],
) -> Step {
    let study = problem.study();
    let vector = |evaluation: Evaluation| -> Option<Vec<f64>> {
        let scaled = evaluation.scaled?;
        let of_rows = || counting(problem).into_iter().map(|i| scaled[i]).collect();
        Some(if evaluation.residuals.is_empty() { of_rows() } else { evaluation.residuals })
    };
    let moved = |changes: &[(usize, f64)]| {
        let mut tuners = at.to_vec();
        for &(k, share) in changes {
            let (i, step) = (problem.active()[k], 0.1 * share);
            let straight = straight || coordinates[k].is_by_range();
            tuners[i] = if straight { tuners[i] + step * coordinates[k].scale() } else { tuners[i] * math::exp(step) };
        }
        study.apply_ties(&mut tuners);
        vector(problem.evaluate_at(&tuners))
    };
    let unknown = Step { remaining: f64::NAN, has_effect: false };
    let Some(here) = vector(problem.evaluate_at(at)) else { return unknown };
    let change = |changes: &[(usize, f64)]| -> f64 {
        let Some(there) = moved(changes) else { return f64::NAN };
        there.iter().zip(&here).map(|(a, b)| math::powi(a - b, 2)).sum::<f64>().sqrt()
    };
    let one_by_one = blind.changes.iter().map(|&one| change(&[one])).fold(0.0, f64::max);
    let together = change(&blind.changes);
    let size = here.iter().map(|value| value.abs()).fold(0.0, f64::max);
    Step {
        remaining: if together == 0.0 { 0.0 } else { together / one_by_one },
        has_effect: together > NEGLIGIBLE * (size + SMALL_OBJECTIVE),
    }
}
