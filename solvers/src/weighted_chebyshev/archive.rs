//! What is known of the problem: every point that a subproblem has evaluated, to start others from.

use std::collections::HashSet;

use mops_core::{Evaluation, FEASIBLE, Shape};

use super::scalarisation::Scalarisation;

/// A point that meets all constraints, with its criteria.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The point of the unit box.
    pub point: Vec<f64>,
    /// Weighted scaled values of the rows to be minimised.
    pub criteria: Vec<f64>,
}

impl Candidate {
    /// Whether it is worse in no criterion and better in one by more than `margin`, in units of `range`.
    pub fn dominates(&self, other: &Self, range: &[f64], margin: f64) -> bool {
        let gains = || self.criteria.iter().zip(&other.criteria).zip(range).map(|((a, b), range)| (b - a) / range);
        gains().all(|gain| gain >= 0.0) && gains().any(|gain| gain > margin)
    }

    /// The largest distance along a coordinate.
    pub fn distance(&self, other: &Self) -> f64 {
        self.point.iter().zip(&other.point).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }
}

/// Every feasible point that was evaluated, in that order.
#[derive(Debug, Default)]
pub struct Archive {
    candidates: Vec<Candidate>,
    seen: HashSet<Vec<u64>>,
}

impl Archive {
    /// Takes in answers of the problem itself.
    pub fn record(&mut self, shape: &Shape, answers: &[Evaluation]) {
        for answer in answers {
            let Some(scaled) = answer.scaled.as_ref().filter(|_| answer.merit.violation <= FEASIBLE) else { continue };
            if self.seen.insert(answer.point.iter().map(|u| u.to_bits()).collect()) {
                self.candidates.push(Candidate { point: answer.point.clone(), criteria: shape.objectives(scaled) });
            }
        }
    }

    /// All of them.
    pub fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    /// The `count` best for a subproblem, the best first, each at least `apart` from those before.
    pub fn best(&self, scalarisation: &Scalarisation, count: usize, distance: f64) -> Vec<Candidate> {
        let key = |candidate: &Candidate| {
            let merit = scalarisation.merit(&candidate.criteria);
            (merit.violation.max(FEASIBLE), merit.objective)
        };
        let mut order: Vec<((f64, f64), &Candidate)> =
            self.candidates.iter().map(|candidate| (key(candidate), candidate)).collect();
        order.sort_by(|(a, _), (b, _)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut selected: Vec<Candidate> = Vec::new();
        for (_, candidate) in order {
            if selected.len() == count {
                break;
            }
            if selected.iter().all(|other| candidate.distance(other) >= distance) {
                selected.push(candidate.clone());
            }
        }
        selected
    }
}
