//! How a solver does on a problem.

use mops_core::{Budget, Evaluator, FEASIBLE, Merit, Run, Solver, Stop};

use crate::problem::Problem;

/// What a solver made of a problem.
#[derive(Debug, Clone)]
pub struct Measured {
    /// Why it stopped.
    pub stop: Stop,
    /// What the best point is worth.
    pub best: Merit,
    /// The known minimum nearest to it.
    pub target: Option<f64>,
    /// What every point is worth, in the order of evaluation.
    pub history: Vec<Merit>,
    /// Number of times that exact slopes were taken.
    pub linearisations: usize,
}

impl Measured {
    /// Number of points until one met every constraint and lay at most `accuracy` above the target, relative to the larger
    /// of 1 and its size.
    pub fn evaluations_to(&self, accuracy: f64) -> Option<usize> {
        let target = self.target?;
        let limit = target + accuracy * target.abs().max(1.0);
        let reached = |merit: &Merit| merit.violation <= FEASIBLE && merit.objective <= limit;
        self.history.iter().position(reached).map(|index| index + 1)
    }

    /// Whether the solver says it has an optimum at a point that violates a constraint.
    pub fn claims_what_is_violated(&self) -> bool {
        self.stop == Stop::Converged && self.best.violation > FEASIBLE
    }
}

/// Solves a problem from a point of the unit box with at most `budget` points.
pub fn measure<E: Evaluator>(
    problem: &Problem,
    posed: &E,
    start: &[f64],
    solver: &mut dyn Solver,
    budget: usize,
) -> Measured {
    let mut run = Run::new(posed, Budget { evaluations: budget }, &());
    let stop = run.solve(solver, start);
    let history: Vec<Merit> = run.archive().iter().map(|record| record.merit).collect();
    let best = history
        .iter()
        .copied()
        .fold(Merit::FAILED, |best, merit| if merit.is_better_than(&best) { merit } else { best });
    let target = problem.nearest_minimum(best.objective);
    Measured { stop, best, target, history, linearisations: run.linearisations() }
}
