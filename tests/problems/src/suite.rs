//! Suites of related problems.

use crate::problem::Problem;

/// Suite of related problems.
#[derive(Debug, Clone, Copy)]
pub struct Suite {
    /// Name on the command line.
    pub name: &'static str,
    /// Contents, in one sentence.
    pub about: &'static str,
    /// Source of the definitions.
    pub source: &'static str,
    /// Accuracy that counts as solved, relative to the larger of 1 and the magnitude of the optimum.
    pub accuracy: f64,
    /// Maximum number of evaluated points, as a function of the number of variables.
    pub budget: fn(usize) -> usize,
    /// Problems of the suite.
    pub problems: fn() -> Vec<Problem>,
}
