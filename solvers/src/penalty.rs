//! Exact penalty function, for solvers that compare scalars only.

use mops_core::{Evaluation, Merit};

/// Returns the objective plus ten times the violation, an exact penalty if no multiplier exceeds 10. Infinite for a
/// failed point.
pub fn penalised(evaluation: &Evaluation) -> f64 {
    let Merit { objective, violation } = evaluation.merit;
    if evaluation.scaled.is_some() { objective + 10.0 * violation } else { f64::INFINITY }
}
