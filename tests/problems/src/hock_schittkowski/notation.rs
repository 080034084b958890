//! Short notation of the problems.

use crate::formula::Functions;
use crate::problem::{Answer, Problem};

/// Creates a problem from its number and its counts of inequalities and equalities.
pub(super) fn hs(
    number: u32,
    start: &[f64],
    counts: [usize; 2],
    answer: impl Into<Answer>,
    functions: Functions,
) -> (u32, Problem) {
    let [inequalities, equalities] = counts;
    (number, Problem { inequalities, equalities, ..Problem::new(&format!("HS{number}"), start, answer, functions) })
}

/// Adds bounds to a problem.
pub(super) fn within(bounds: &[[f64; 2]], (number, problem): (u32, Problem)) -> (u32, Problem) {
    (number, Problem { bounds: bounds.to_vec(), ..problem })
}

pub(super) const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

pub(super) const POSITIVE: [f64; 2] = [0.0, f64::INFINITY];
