//! One number for solvers that can only compare numbers.

use mops_core::{Evaluation, Merit};

/// The objective plus ten times the violation: an exact penalty as long as no multiplier exceeds 10. Infinite for a
/// failed point.
pub fn penalised(evaluation: &Evaluation) -> f64 {
    let Merit { objective, violation } = evaluation.merit;
    if evaluation.scaled.is_some() { objective + 10.0 * violation } else { f64::INFINITY }
}
