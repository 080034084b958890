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
    pub fn sampled(
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

    /// Whether the members no longer differ: in what they are worth, relative to `unit`, or in where they are.
    pub fn has_collapsed(&self, tolerance: f64, unit: f64) -> bool {
        let order = self.order();
        let (best, worst) = (self.merits[order[0]], self.merits[order[self.len() - 1]]);
        let flat = |a: f64, b: f64, unit: f64| (b - a).abs() <= tolerance * a.abs().max(unit);
        let equal = best.is_feasible() == worst.is_feasible()
            && (best == worst
                || (flat(best.objective, worst.objective, unit)
                    && (best.is_feasible() || flat(best.violation, worst.violation, 1.0))));
        let spread = |j: usize| {
            let (low, high) = self.points.iter().fold((1.0_f64, 0.0_f64), |(l, h), p| (l.min(p[j]), h.max(p[j])));
            high - low
        };
        equal || (0..self.points[0].len()).all(|j| spread(j) < 1e-12)
    }
}

/// The merits of evaluations.
pub fn merits(evaluations: &[Evaluation]) -> Vec<Merit> {
    evaluations.iter().map(|evaluation| evaluation.merit).collect()
}

/// Counts the generations since the best of a population got better.
#[derive(Debug, Clone, Copy)]
pub struct Patience {
    best: Merit,
    idle: usize,
}

impl Patience {
    /// Before the first generation.
    pub const NEW: Self = Self { best: Merit::FAILED, idle: 0 };

    /// Generations in a row without a better point, this one included.
    pub fn tell(&mut self, best: Merit) -> usize {
        self.idle = if best.is_better_than(&self.best) { 0 } else { self.idle + 1 };
        if self.idle == 0 {
            self.best = best;
        }
        self.idle
    }
}
