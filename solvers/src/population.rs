//! Population of points and its stagnation test.

use mops_core::{Evaluation, Halt, Merit, Oracle};
use mops_math::Stream;

use crate::ranking::compare;
use crate::start::latin_hypercube;

/// Points of the unit box with their merits.
#[derive(Debug, Clone)]
pub struct Population {
    /// Points.
    pub points: Vec<Vec<f64>>,
    /// Merits of the points.
    pub merits: Vec<Merit>,
}

impl Population {
    /// Samples and evaluates a population; its first member is `start`, if given.
    ///
    /// # Errors
    /// When the run ends: budget exhausted, or interrupted by the user.
    pub fn sample(
        oracle: &mut dyn Oracle,
        size: usize,
        start: Option<&[f64]>,
        random: &mut Stream,
    ) -> Result<Self, Halt> {
        let mut points = latin_hypercube(size, oracle.shape().dimension(), random);
        if let (Some(start), Some(first)) = (start, points.first_mut()) {
            *first = start.to_vec();
        }
        let merits = merits(&oracle.evaluate(&points)?);
        Ok(Self { points, merits })
    }

    /// Returns the number of members.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Returns the indices of the members, the best first.
    pub fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by(|&a, &b| compare(&self.merits[a], &self.merits[b]));
        order
    }

    /// Keeps the `size` best members, in order, and returns the points of the others as memory for children.
    pub fn truncate(&mut self, size: usize) -> impl Iterator<Item = Vec<f64>> + use<> {
        let order = self.order();
        let (mut points, merits) = (std::mem::take(&mut self.points), std::mem::take(&mut self.merits));
        self.points = order[..size].iter().map(|&i| std::mem::take(&mut points[i])).collect();
        self.merits = order[..size].iter().map(|&i| merits[i]).collect();
        points.into_iter().filter(|point| !point.is_empty())
    }

    /// Returns true if the members no longer differ, in merit relative to `unit`, or in position.
    fn has_converged(&self, tolerance: f64, unit: f64) -> bool {
        let order = self.order();
        let (best, worst) = (self.merits[order[0]], self.merits[order[self.len() - 1]]);
        let is_flat = |a: f64, b: f64, unit: f64| (b - a).abs() <= tolerance * a.abs().max(unit);
        let merits_equal = best.is_feasible() == worst.is_feasible()
            && (best == worst
                || (is_flat(best.objective, worst.objective, unit)
                    && (best.is_feasible() || is_flat(best.violation, worst.violation, 1.0))));
        let spread = |j: usize| {
            let (low, high) = self.points.iter().fold((1.0_f64, 0.0_f64), |(l, h), p| (l.min(p[j]), h.max(p[j])));
            high - low
        };
        merits_equal || (0..self.points[0].len()).all(|j| spread(j) < 1e-12)
    }
}

/// Returns the merits of evaluations.
pub fn merits(evaluations: &[Evaluation]) -> Vec<Merit> {
    evaluations.iter().map(|evaluation| evaluation.merit).collect()
}

/// Rule for resampling a population.
#[derive(Debug, Clone, Copy)]
pub struct RestartRule {
    /// Difference of the members' values, relative to the objective, below which the population has converged.
    pub tolerance: f64,
    /// Number of generations without improvement before a restart.
    pub patience: usize,
    /// Maximum number of restarts.
    pub restarts: usize,
}

/// Continuation after a generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// Next generation.
    Generation,
    /// New members.
    Restart,
    /// End of the search.
    End,
}

/// Monitor of convergence and stagnation over the generations.
#[derive(Debug, Clone)]
pub struct StagnationMonitor {
    rule: RestartRule,
    /// Magnitude of the objective below which differences count absolutely.
    unit: f64,
    best: Merit,
    stalled: usize,
    restarts: usize,
}

impl StagnationMonitor {
    /// Creates the monitor from the first members, of which the first is the starting point.
    pub fn new(members: &Population, rule: RestartRule) -> Self {
        let unit = members.merits[0].objective.abs().min(1.0);
        Self { rule, unit, best: Merit::FAILED, stalled: 0, restarts: 0 }
    }

    /// Returns the continuation after a generation with these members.
    pub fn next(&mut self, members: &Population) -> Next {
        let best = members.merits[members.order()[0]];
        self.stalled = if best.is_better_than(&self.best) { 0 } else { self.stalled + 1 };
        if self.stalled == 0 {
            self.best = best;
        }
        if self.stalled < self.rule.patience && !members.has_converged(self.rule.tolerance, self.unit) {
            return Next::Generation;
        }
        if self.restarts >= self.rule.restarts {
            return Next::End;
        }
        self.restarts += 1;
        (self.best, self.stalled) = (Merit::FAILED, 0);
        Next::Restart
    }
}
