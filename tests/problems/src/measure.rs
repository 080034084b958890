//! Measurement of a solver on a problem.

use mops_core::{
    Merit, Oracle, Run, Solver, Stop,
    evaluation::FEASIBLE,
    front::{hypervolume, inverted_generational_distance, non_dominated},
    problem::Evaluator,
    run::{Budget, Record},
};

use crate::problem::Answer;

/// Result of a solver on a problem.
#[derive(Debug, Clone)]
pub struct Measured {
    /// Reason for termination.
    pub stop: Stop,
    /// Merit of the best point.
    pub best: Merit,
    /// Known minimum nearest to the best point.
    pub target: Option<f64>,
    /// Merit of every point, in the order of evaluation.
    pub history: Vec<Merit>,
    /// Number of exact linearisations.
    pub linearisations: usize,
    /// Quality of the front, if the answer is a front.
    pub front: Option<FrontFound>,
}

/// Quality of a computed front.
#[derive(Debug, Clone, Copy)]
pub struct FrontFound {
    /// Hypervolume of the solver's members, or of all points if it has none.
    pub hypervolume: f64,
    /// Inverted generational distance of the members, or of all points, to 1000 points of the true front.
    pub distance: f64,
    /// Hypervolume of all evaluated points.
    pub archive: f64,
    /// Hypervolume of the true front.
    pub known: f64,
}

impl Measured {
    /// Returns the number of points until one satisfied every constraint and was at most `accuracy` above the target.
    /// `accuracy` is relative to the larger of 1 and the magnitude of the target.
    pub fn evaluations_to(&self, accuracy: f64) -> Option<usize> {
        let target = self.target?;
        let limit = target + accuracy * target.abs().max(1.0);
        let reached = |merit: &Merit| merit.violation <= FEASIBLE && merit.objective <= limit;
        self.history.iter().position(reached).map(|index| index + 1)
    }

    /// Returns true if the solver claims an optimum at a point that violates a constraint.
    pub fn claims_what_is_violated(&self) -> bool {
        self.stop == Stop::Converged && self.best.violation > FEASIBLE
    }
}

/// Merit of a point without noise, as a function of its tuners.
pub type Truth<'a> = &'a (dyn Fn(&[f64]) -> Merit + Sync);

/// Solves a problem from a point of the unit box, with at most `budget` evaluated points. For a noisy problem, `truth`
/// assesses the results: every point counts as the best one seen so far.
pub fn measure<E: Evaluator>(
    answer: &Answer,
    posed: &E,
    start: &[f64],
    solver: &mut dyn Solver,
    budget: usize,
    truth: Option<Truth<'_>>,
) -> Measured {
    let mut run = Run::new(posed, Budget { evaluations: budget }, &());
    let stop = run.solve(solver, start);
    let (mut best, mut seen) = (Merit::FAILED, Merit::FAILED);
    let worth = |record: &Record| {
        let is_better = record.merit.is_better_than(&seen);
        if is_better {
            seen = record.merit;
            best = truth.map_or(seen, |truth| truth(&record.tuners));
        }
        if truth.is_some() { best } else { record.merit }
    };
    let history: Vec<Merit> = run.archive().iter().map(worth).collect();
    let target = answer.nearest_minimum(best.objective);
    let linearisations = run.linearisations();
    let front = front(answer, &mut run, solver);
    Measured { stop, best, target, history, linearisations, front }
}

fn front<E: Evaluator>(answer: &Answer, run: &mut Run<'_, E>, solver: &dyn Solver) -> Option<FrontFound> {
    let Answer::Front { reference, hypervolume: known, points } = answer else { return None };
    let m = reference.len();
    let all: Vec<f64> = run.front().into_iter().flat_map(|i| run.archive()[i].objectives.clone()).collect();
    // Every member has been evaluated: evaluating it again costs nothing.
    let members = run.evaluate(solver.members()).unwrap_or_default();
    let shape = run.shape();
    let feasible = members.iter().filter(|member| member.merit.is_feasible());
    let members: Vec<f64> =
        feasible.flat_map(|member| member.scaled.as_ref().map(|s| shape.objectives(s)).unwrap_or_default()).collect();
    let kept: Vec<f64> = if members.is_empty() {
        all.clone()
    } else {
        non_dominated(&members, m).into_iter().flat_map(|i| members[i * m..(i + 1) * m].to_vec()).collect()
    };
    Some(FrontFound {
        hypervolume: hypervolume(&kept, reference),
        distance: inverted_generational_distance(&kept, m, &points(1000)),
        archive: hypervolume(&all, reference),
        known: *known,
    })
}
