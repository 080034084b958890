//! Archive of all feasible points evaluated by subproblems, which provides their starting points.

use std::collections::HashSet;

use mops_core::{Evaluation, Shape, evaluation::FEASIBLE, front::SAME};

use super::scalarisation::Scalarisation;

/// Feasible point with its criteria.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Point of the unit box.
    pub point: Vec<f64>,
    /// Weighted scaled values of the objectives.
    pub objectives: Vec<f64>,
}

impl Candidate {
    /// Returns true if no criterion is worse and one is better by more than `margin`, in units of `range`.
    pub fn dominates(&self, other: &Self, range: &[f64], margin: f64) -> bool {
        let gains = || self.objectives.iter().zip(&other.objectives).zip(range).map(|((a, b), range)| (b - a) / range);
        gains().all(|gain| gain >= 0.0) && gains().any(|gain| gain > margin)
    }

    /// Returns the maximum-norm distance of the objectives of two points, in units of `range`.
    pub fn separation(&self, other: &Self, range: &[f64]) -> f64 {
        let gaps =
            self.objectives.iter().zip(&other.objectives).zip(range).map(|((a, b), range)| (a - b).abs() / range);
        gaps.fold(0.0, f64::max)
    }

    /// Returns the maximum-norm distance of two points.
    pub fn distance(&self, other: &Self) -> f64 {
        self.point.iter().zip(&other.point).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }
}

/// Feasible points in the order of their evaluation.
#[derive(Debug, Default)]
pub struct Archive {
    candidates: Vec<Candidate>,
    seen: HashSet<Vec<u64>>,
}

impl Archive {
    /// Records the feasible points among evaluations of the original problem.
    pub fn record(&mut self, shape: &Shape, answers: &[Evaluation]) {
        for answer in answers {
            let Some(scaled) = answer.scaled.as_ref().filter(|_| answer.merit.violation <= FEASIBLE) else { continue };
            if self.seen.insert(answer.point.iter().map(|u| u.to_bits()).collect()) {
                self.candidates.push(Candidate { point: answer.point.clone(), objectives: shape.objectives(scaled) });
            }
        }
    }

    /// Returns all recorded points.
    pub fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    /// Returns the `count` best points for a subproblem, the best first, at a mutual distance of at least `distance`.
    pub fn best(&self, scalarisation: &Scalarisation, count: usize, distance: f64) -> Vec<Candidate> {
        let key = |candidate: &Candidate| {
            let merit = scalarisation.merit(&candidate.objectives);
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

/// Inserts a point into the front and removes points that it dominates; returns false if the point is dominated itself,
/// or if it is the same as one of the front. `range` holds the range of every objective over the front; it is empty
/// until the ends of the front are known.
pub(super) fn insert(front: &mut Vec<Candidate>, candidate: Candidate, range: &[f64]) -> bool {
    let one = vec![1.0; candidate.objectives.len()];
    let is_dominated =
        |other: &Candidate| other.objectives == candidate.objectives || other.dominates(&candidate, &one, 0.0);
    if front.iter().any(is_dominated) {
        return false;
    }
    front.retain(|other| !candidate.dominates(other, &one, 0.0));
    if !range.is_empty() && front.iter().any(|other| other.separation(&candidate, range) <= SAME) {
        return false;
    }
    front.push(candidate);
    true
}
