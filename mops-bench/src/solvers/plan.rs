//! Plan of a benchmark of solvers.

use mops::Catalogue;
use mops::core::Shape;
use mops::core::catalogue::SolverChoice;
use mops_problems::Slope;

use super::suite::{Subject, Suite};

/// Plan of a benchmark.
pub(crate) struct Plan {
    pub suite: Suite,
    pub solvers: Vec<SolverChoice>,
    pub slope: Slope,
    /// Number of seeds, starting at 1.
    pub seeds: u64,
    /// Budget as a multiple of n + 1 evaluations for n variables; that of the suite if absent.
    pub budget: Option<usize>,
    /// Relative noise added to all values.
    pub noise: f64,
    /// Names of the selected problems; all if empty.
    pub only: Vec<String>,
}

impl Plan {
    /// Returns the selected problems.
    pub(super) fn subjects(&self) -> Vec<Subject> {
        let mut subjects = self.suite.subjects();
        subjects.retain(|subject| self.only.is_empty() || self.only.iter().any(|name| name == subject.name()));
        subjects
    }

    /// Returns a solver that accepts none of the problems, if there is one.
    pub fn idle(&self, catalogue: &Catalogue) -> Option<&SolverChoice> {
        let shapes: Vec<Shape> = self.subjects().iter().map(|subject| subject.shape(catalogue)).collect();
        let accepts = |solver: &SolverChoice| shapes.iter().any(|shape| solver.make().accepts(shape).is_ok());
        self.solvers.iter().find(|solver| !accepts(solver))
    }

    pub(super) fn evaluations(&self, variables: usize) -> usize {
        self.budget.map_or_else(|| (self.suite.budget)(variables), |budget| budget * (variables + 1))
    }
}

/// Accuracy of the first count of evaluations.
pub(crate) const ROUGH: f64 = 1e-3;
