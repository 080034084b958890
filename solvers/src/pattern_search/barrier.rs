//! Which points a search may move to where constraints count: a progressive barrier.

use mops_core::{FEASIBLE, Merit};

/// A violation up to which a constraint holds for the search: well below what the user is granted, so that a point that spends
/// some of that is not the best feasible one.
const FEASIBILITY_TOLERANCE: f64 = 1e-9;

/// Share of what was promised that a step must keep.
const MIN_RATIO: f64 = 0.1;

/// The least that a step which lessens the violation leaves of the limit, and of the way between both violations.
const REDUCTION: f64 = 0.5;

/// The first limit where less is violated at the start.
const INITIAL_LIMIT: f64 = 0.1;

/// By how much a step of the models lessens objective and violation; negative where it raises them.
#[derive(Debug, Clone, Copy)]
pub struct PredictedReduction {
    /// Of the objective.
    pub objective: f64,
    /// Of the violation.
    pub violation: f64,
}

impl PredictedReduction {
    /// The share of it that a step has kept: of the violation, where with a given weight more was promised of it than of the
    /// objective, else of the objective.
    pub fn reduction_ratio(&self, from: &Merit, to: &Merit, weight: f64) -> f64 {
        if weight * self.violation > self.objective {
            (violation(from) - violation(to)) / self.violation
        } else {
            (from.objective - to.objective) / self.objective
        }
    }
}

/// Violations above a limit are not admitted; the limit falls as the search goes on. Below it, objective and violation are
/// judged apart, without a weight between them. The search moves to where the violation falls; where the objective falls and
/// the violation does not rise; and, at the end of a step of the models that promised it, where the objective falls. It does
/// not move to a feasible point that is no better than the best one.
///
/// Source: C. Audet, J. E. Dennis, SIAM J. Optimization 20 (2009) 445-472 (progressive barrier); the third case: N. I. M.
/// Gould, Ph. L. Toint, Mathematical Programming 122 (2010) 155-196, and for models without slopes Ph. R. Sampaio, Ph. L.
/// Toint, Computational Optimization and Applications 61 (2015) 25-49 (funnel).
#[derive(Debug, Clone)]
pub struct Barrier {
    /// The largest violation that is admitted; never less than what the user is granted.
    limit: f64,
    /// The least objective of a feasible point.
    best_feasible: f64,
}

impl Barrier {
    /// The barrier of a search that begins at a point.
    pub fn new(start: &Merit) -> Self {
        let mut barrier = Self { limit: (1.5 * start.violation).max(INITIAL_LIMIT), best_feasible: f64::INFINITY };
        barrier.record(start);
        barrier
    }

    /// Keeps the best feasible objective.
    pub fn record(&mut self, merit: &Merit) {
        if violation(merit) == 0.0 {
            self.best_feasible = self.best_feasible.min(merit.objective);
        }
    }

    /// Whether the search may move from one point to another, to which a step of the models has led that promised something.
    pub fn accepts(&self, from: &Merit, to: &Merit, predicted: Option<PredictedReduction>) -> bool {
        let (before, after) = (violation(from), violation(to));
        let decrease = from.objective - to.objective;
        if !(after <= self.limit && to.objective.is_finite()) || (after == 0.0 && to.objective >= self.best_feasible) {
            return false;
        }
        if after <= before {
            return decrease > 0.0 || after < before;
        }
        predicted.is_some_and(|predicted| predicted.objective > 0.0 && decrease >= MIN_RATIO * predicted.objective)
    }

    /// Lowers the limit after a step that lessened the violation.
    pub fn tighten(&mut self, from: &Merit, to: &Merit) {
        let (before, after) = (violation(from), violation(to));
        if after < before {
            self.limit =
                self.limit.min((REDUCTION * self.limit).max(after + REDUCTION * (before - after)).max(FEASIBLE));
        }
    }
}

/// The violation, 0 where constraints hold.
pub fn violation(merit: &Merit) -> f64 {
    if merit.violation <= FEASIBILITY_TOLERANCE { 0.0 } else { merit.violation }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn merit(violation: f64, objective: f64) -> Merit {
        Merit { violation, objective }
    }

    #[test]
    fn a_feasible_search_stays_feasible_unless_the_models_promise_more() {
        let start = merit(0.0, 1.0);
        let barrier = Barrier::new(&start);
        assert!(barrier.accepts(&start, &merit(0.0, 0.9), None));
        assert!(!barrier.accepts(&start, &merit(0.0, 1.0), None));
        assert!(!barrier.accepts(&start, &merit(0.01, 0.5), None));
        let predicted = Some(PredictedReduction { objective: 0.6, violation: 0.0 });
        assert!(barrier.accepts(&start, &merit(0.01, 0.5), predicted));
        assert!(!barrier.accepts(&start, &merit(0.01, 0.95), predicted), "less than a tenth of the promise");
        assert!(!barrier.accepts(&start, &merit(0.2, 0.5), predicted), "beyond the barrier");
        assert!(!barrier.accepts(&start, &Merit::FAILED, predicted));
    }

    #[test]
    fn less_violation_is_better_whatever_the_objective_but_not_than_what_is_feasible() {
        let mut barrier = Barrier::new(&merit(0.0, 5.0));
        let current = merit(0.05, 1.0);
        assert!(barrier.accepts(&current, &merit(0.04, 9.0), None));
        assert!(barrier.accepts(&current, &merit(0.0, 4.0), None));
        assert!(!barrier.accepts(&current, &merit(0.0, 5.0), None));
        barrier.record(&merit(0.0, 3.0));
        assert!(!barrier.accepts(&current, &merit(0.0, 4.0), None));
    }

    #[test]
    fn the_barrier_falls_with_the_violation_and_ends_at_what_is_granted() {
        let (start, predicted) = (merit(4.0, 0.0), Some(PredictedReduction { objective: 1.0, violation: 0.0 }));
        let mut barrier = Barrier::new(&start);
        assert!(barrier.accepts(&start, &merit(5.0, -1.0), predicted));
        barrier.tighten(&start, &merit(0.0, 1.0));
        assert!(!barrier.accepts(&start, &merit(5.0, -1.0), predicted));
        for _ in 0..40 {
            barrier.tighten(&merit(2.0 * FEASIBLE, 0.0), &merit(0.0, 1.0));
        }
        let feasible = merit(0.0, 1.0);
        assert!(barrier.accepts(&feasible, &merit(FEASIBLE, 0.0), predicted));
        assert!(!barrier.accepts(&feasible, &merit(2.0 * FEASIBLE, 0.0), predicted));
    }
}
