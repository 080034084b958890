//! Members of a population, in one array, and when there is nothing left to expect of it.

use mops_core::{Evaluation, Halt, Merit, Oracle, Stream};

use crate::ranking::compare;
use crate::start::latin_hypercube;

/// Points of the unit box with their merits.
#[derive(Debug, Clone)]
pub struct Population {
    /// The points.
    pub points: Vec<Vec<f64>>,
    /// What they are worth.
    pub merits: Vec<Merit>,
}

impl Population {
    /// A sample of the box whose first member is `start`, where there is one, evaluated.
    ///
    /// # Errors
    /// The run is over.
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

    /// Number of members.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Indices, the best first.
    pub fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by(|&a, &b| compare(&self.merits[a], &self.merits[b]));
        order
    }

    /// Keeps so many of the best, these in order, and gives the others' points, as memory for children.
    pub fn truncate(&mut self, size: usize) -> impl Iterator<Item = Vec<f64>> + use<> {
        let order = self.order();
        let (mut points, merits) = (std::mem::take(&mut self.points), std::mem::take(&mut self.merits));
        self.points = order[..size].iter().map(|&i| std::mem::take(&mut points[i])).collect();
        self.merits = order[..size].iter().map(|&i| merits[i]).collect();
        points.into_iter().filter(|point| !point.is_empty())
    }

    /// Whether the members no longer differ: in what they are worth, relative to `unit`, or in where they are.
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

/// The merits of evaluations.
pub fn merits(evaluations: &[Evaluation]) -> Vec<Merit> {
    evaluations.iter().map(|evaluation| evaluation.merit).collect()
}

/// When the members of a population are drawn anew.
#[derive(Debug, Clone, Copy)]
pub struct RestartRule {
    /// Members are alike when what they are worth differs by less than this, relative to the objective.
    pub tolerance: f64,
    /// Generations without a better point that are too many.
    pub patience: usize,
    /// Number of times that members may be drawn anew.
    pub restarts: usize,
}

/// What comes after a generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// Another one.
    Generation,
    /// New members.
    Restart,
    /// Nothing.
    End,
}

/// Watches a population from generation to generation.
#[derive(Debug, Clone)]
pub struct StagnationMonitor {
    rule: RestartRule,
    /// Size of an objective that counts as one.
    unit: f64,
    best: Merit,
    stalled: usize,
    restarts: usize,
}

impl StagnationMonitor {
    /// From the first members on, the start in front.
    pub fn new(members: &Population, rule: RestartRule) -> Self {
        let unit = members.merits[0].objective.abs().min(1.0);
        Self { rule, unit, best: Merit::FAILED, stalled: 0, restarts: 0 }
    }

    /// What comes after a generation with these members.
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
