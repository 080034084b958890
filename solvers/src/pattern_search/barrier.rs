//! Progressive barrier: acceptance of points under constraints.

use mops_core::{Merit, evaluation::FEASIBLE};

/// Violation up to which a constraint counts as satisfied. Far below the tolerance granted to the user, so that a point
/// that exploits that tolerance is not the best feasible one.
const FEASIBILITY_TOLERANCE: f64 = 1e-9;

/// Smallest ratio of actual to predicted reduction.
const MIN_RATIO: f64 = 0.1;

/// Lower bound of the new limit, as a fraction of the old limit and of the distance between both violations.
const REDUCTION: f64 = 0.5;

/// Minimum of the initial limit.
const INITIAL_LIMIT: f64 = 0.1;

/// Reduction of objective and violation that the models predict for a step; negative for an increase.
#[derive(Debug, Clone, Copy)]
pub struct PredictedReduction {
    /// Reduction of the objective.
    pub objective: f64,
    /// Reduction of the violation.
    pub violation: f64,
}

impl PredictedReduction {
    /// Returns the ratio of actual to predicted reduction: of the violation if it dominates with the given weight,
    /// otherwise of the objective.
    pub fn reduction_ratio(&self, from: &Merit, to: &Merit, weight: f64) -> f64 {
        if weight * self.violation > self.objective {
            (violation(from) - violation(to)) / self.violation
        } else {
            (from.objective - to.objective) / self.objective
        }
    }
}

/// Progressive barrier. Points whose violation exceeds a limit are rejected; the limit decreases during the search.
///
/// Below the limit, objective and violation are compared separately, without a weight. A point is accepted in three
/// cases:
/// - The violation decreases.
/// - The objective decreases and the violation does not increase.
/// - The objective decreases after a model step that predicted it.
///
/// A feasible point is rejected if it is no better than the best feasible one.
///
/// Source: C. Audet, J. E. Dennis, SIAM J. Optimization 20 (2009) 445-472 (progressive barrier); third case: N. I. M.
/// Gould, Ph. L. Toint, Mathematical Programming 122 (2010) 155-196, and, for derivative-free models, Ph. R. Sampaio,
/// Ph. L. Toint, Computational Optimization and Applications 61 (2015) 25-49 (funnel).
#[derive(Debug, Clone)]
pub struct Barrier {
    /// Largest accepted violation; at least the tolerance granted to the user.
    limit: f64,
    /// Smallest objective of a feasible point.
    best_feasible: f64,
}

impl Barrier {
    /// Creates the barrier of a search from the merit of its starting point.
    pub fn new(start: &Merit) -> Self {
        let mut barrier = Self { limit: (1.5 * start.violation).max(INITIAL_LIMIT), best_feasible: f64::INFINITY };
        barrier.record(start);
        barrier
    }

    /// Updates the best feasible objective.
    pub fn record(&mut self, merit: &Merit) {
        if violation(merit) == 0.0 {
            self.best_feasible = self.best_feasible.min(merit.objective);
        }
    }

    /// Returns true if the search may move from one point to another. `predicted` is the predicted reduction of a model
    /// step.
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

    /// Lowers the limit after a step that reduced the violation.
    pub fn tighten(&mut self, from: &Merit, to: &Merit) {
        let (before, after) = (violation(from), violation(to));
        if after < before {
            self.limit =
                self.limit.min((REDUCTION * self.limit).max(after + REDUCTION * (before - after)).max(FEASIBLE));
        }
    }
}

/// Returns the violation, 0 if all constraints are satisfied.
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
    fn a_feasible_search_stays_feasible_unless_the_models_predict_more() {
        let start = merit(0.0, 1.0);
        let barrier = Barrier::new(&start);
        assert!(barrier.accepts(&start, &merit(0.0, 0.9), None));
        assert!(!barrier.accepts(&start, &merit(0.0, 1.0), None));
        assert!(!barrier.accepts(&start, &merit(0.01, 0.5), None));
        let predicted = Some(PredictedReduction { objective: 0.6, violation: 0.0 });
        assert!(barrier.accepts(&start, &merit(0.01, 0.5), predicted));
        assert!(
            !barrier.accepts(&start, &merit(0.01, 0.95), predicted),
            "less than a tenth of the predicted reduction"
        );
        assert!(!barrier.accepts(&start, &merit(0.2, 0.5), predicted), "beyond the barrier");
        assert!(!barrier.accepts(&start, &Merit::FAILED, predicted));
    }

    #[test]
    fn less_violation_is_better_for_any_objective_but_not_than_a_feasible_point() {
        let mut barrier = Barrier::new(&merit(0.0, 5.0));
        let current = merit(0.05, 1.0);
        assert!(barrier.accepts(&current, &merit(0.04, 9.0), None));
        assert!(barrier.accepts(&current, &merit(0.0, 4.0), None));
        assert!(!barrier.accepts(&current, &merit(0.0, 5.0), None));
        barrier.record(&merit(0.0, 3.0));
        assert!(!barrier.accepts(&current, &merit(0.0, 4.0), None));
    }

    #[test]
    fn the_barrier_falls_with_the_violation_down_to_the_tolerance() {
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
