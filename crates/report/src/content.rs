//! Content of a report.

use mops_tasks::{Room, Solution, Solved};

/// Content of a report.
pub struct Report<'a> {
    /// Result of the run, with what it rests on.
    pub solution: Solution<'a>,
    /// What performed the task.
    pub room: &'a dyn Room,
    /// Text of the study file, with its settings.
    pub text: &'a str,
}

impl<'a> Report<'a> {
    /// Creates the report of a solved study; `text` is that of its file, with its settings.
    pub fn new(solved: &'a Solved, room: &'a dyn Room, text: &'a str) -> Self {
        Self { solution: solved.into(), room, text }
    }
}

impl Report<'_> {
    /// Returns the name of the reported point: `optimum` only if the solver converged to a feasible point.
    pub(crate) fn best_name(&self) -> &'static str {
        self.solution.best_name()
    }
}
