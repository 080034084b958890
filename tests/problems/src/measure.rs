//! How a solver does on a problem.

use mops_core::front::{hypervolume, inverted_generational_distance, non_dominated};
use mops_core::{Budget, Evaluator, FEASIBLE, Merit, Oracle, Record, Run, Solver, Stop};

use crate::problem::Answer;

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
    /// The front, where the answer is one.
    pub front: Option<FrontFound>,
}

/// How good a front is that was found.
#[derive(Debug, Clone, Copy)]
pub struct FrontFound {
    /// Hypervolume of the solver's members, of all points where it has none.
    pub hypervolume: f64,
    /// Inverted generational distance of the same, to 1000 points of the true front.
    pub distance: f64,
    /// Hypervolume of all points that were evaluated.
    pub archive: f64,
    /// Hypervolume of the true front.
    pub known: f64,
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

/// What a point is worth without noise, by the values of its tuners.
pub type Truth<'a> = &'a (dyn Fn(&[f64]) -> Merit + Sync);

/// Solves a problem with this answer from a point of the unit box with at most `budget` points. Where there is noise, `truth`
/// judges: every point counts as the best one that was seen until then.
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
    // Every member has been evaluated: asking again costs nothing.
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
