//! What is known of the problem: every point that a subproblem has evaluated, to start others from.

use std::collections::HashSet;

use mops_core::{Evaluation, FEASIBLE, Shape};

use super::aim::Aim;

/// A point that meets all constraints, with its criteria.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// The point of the unit box.
    pub point: Vec<f64>,
    /// Weighted scaled values of the rows to be minimised.
    pub criteria: Vec<f64>,
}

impl Place {
    /// Whether it is worse in no criterion and better in one by more than `margin`, in units of `range`.
    pub fn dominates(&self, other: &Self, range: &[f64], margin: f64) -> bool {
        let ahead = || self.criteria.iter().zip(&other.criteria).zip(range).map(|((a, b), range)| (b - a) / range);
        ahead().all(|ahead| ahead >= 0.0) && ahead().any(|ahead| ahead > margin)
    }

    /// The largest distance along a coordinate.
    pub fn apart(&self, other: &Self) -> f64 {
        self.point.iter().zip(&other.point).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }
}

/// Every feasible point that was evaluated, in that order.
#[derive(Debug, Default)]
pub struct Known {
    places: Vec<Place>,
    seen: HashSet<Vec<u64>>,
}

impl Known {
    /// Takes in answers of the problem itself.
    pub fn take(&mut self, shape: &Shape, answers: &[Evaluation]) {
        for answer in answers {
            let Some(scaled) = answer.scaled.as_ref().filter(|_| answer.merit.violation <= FEASIBLE) else { continue };
            if self.seen.insert(answer.point.iter().map(|u| u.to_bits()).collect()) {
                self.places.push(Place { point: answer.point.clone(), criteria: shape.objectives(scaled) });
            }
        }
    }

    /// All of them.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// The `count` best for a subproblem, the best first, each at least `apart` from those before.
    pub fn best_for(&self, aim: &Aim, count: usize, apart: f64) -> Vec<Place> {
        let key = |place: &Place| {
            let merit = aim.merit(&place.criteria);
            (merit.violation.max(FEASIBLE), merit.objective)
        };
        let mut order: Vec<((f64, f64), &Place)> = self.places.iter().map(|place| (key(place), place)).collect();
        order.sort_by(|(a, _), (b, _)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut taken: Vec<Place> = Vec::new();
        for (_, place) in order {
            if taken.len() == count {
                break;
            }
            if taken.iter().all(|other| place.apart(other) >= apart) {
                taken.push(place.clone());
            }
        }
        taken
    }
}
