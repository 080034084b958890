//! Cost of confirming an optimum, limited in proportion to the cost of finding it.

use mops_core::{
    Merit, Oracle,
    solver::{Basins, Optimality, SMALL_OBJECTIVE},
};

/// Evaluations of a search up to its last gain, and since then.
///
/// Only further searches can confirm the best point. The evaluations spent on them are limited in proportion to the
/// evaluations up to the last gain: an optimum that was cheap to find is cheap to confirm. See [`is_gain`] for what
/// counts as a gain.
#[derive(Debug, Clone, Copy)]
pub struct Confirmation {
    /// Remaining evaluations at the beginning of the search.
    remaining_at_start: usize,
    /// Evaluations up to the last gain.
    to_gain: usize,
    /// Merit at the last gain.
    merit: Option<Merit>,
}

/// Limit on the evaluations since the last gain, relative to those up to it, where the best point is stationary and no
/// search has ended at another optimum.
///
/// With it, `auto` solves as many problems of the suites `minimax`, `hock-schittkowski` and `control` as without a
/// limit.
const FACTOR_UNIQUE: usize = 3;

/// Limit on the evaluations since the last gain, relative to those up to it, otherwise. At kinks, discontinuities and
/// in narrow curved valleys, local searches may end away from an optimum. With 20, one of five seeds misses the minimum
/// settling time under an overshoot limit.
pub const FACTOR_OTHERWISE: usize = 60;

/// Relative decrease of the violation of an infeasible point that counts as a gain.
const LESS_VIOLATION: f64 = 1e-3;

/// Number of starting points in a sample of the box, per coordinate and one more. A gain counts as at least two such
/// samples.
pub const SAMPLE: usize = 5;

/// Returns the limit factor of a best point with this merit and classification, given the ends of the searches.
pub fn factor(best: Merit, optimality: Optimality, ends: &[Merit]) -> usize {
    let is_unique = Basins::of(best, ends).optima < 2;
    if is_unique && optimality == Optimality::Stationary { FACTOR_UNIQUE } else { FACTOR_OTHERWISE }
}

impl Confirmation {
    /// Creates the state at the beginning of a search.
    pub fn begin(oracle: &dyn Oracle) -> Self {
        Self { remaining_at_start: oracle.remaining(), to_gain: 0, merit: None }
    }

    /// Takes the best point into account; returns true if it is a gain.
    pub fn observe(&mut self, oracle: &dyn Oracle) -> bool {
        let Some(merit) = oracle.best().map(|best| best.merit) else { return false };
        let is_gain = self.merit.is_none_or(|known| is_gain(&merit, &known));
        if is_gain {
            (self.merit, self.to_gain) = (Some(merit), self.remaining_at_start - oracle.remaining());
        }
        is_gain
    }

    /// Returns true if more than `factor` times the evaluations up to the last gain have been spent since.
    pub fn exceeds(&self, oracle: &dyn Oracle, factor: usize) -> bool {
        let least = 2 * SAMPLE * (oracle.shape().dimension() + 1);
        self.remaining_at_start - oracle.remaining() - self.to_gain > factor * self.to_gain.max(least)
    }
}

/// Returns true if a merit is a gain over a known one: the first feasible point, a decrease of the objective by more
/// than a thousandth, or, without a feasible point, of the violation.
pub fn is_gain(merit: &Merit, known: &Merit) -> bool {
    match (known.is_feasible(), merit.is_feasible()) {
        (true, true) => merit.is_better_than(known) && Basins::of(*known, &[*merit]).arrived == 0,
        (false, true) => true,
        (true, false) => false,
        // A failed point has an infinite violation.
        (false, false) => {
            known.violation.is_infinite() && merit.violation.is_finite()
                || known.violation - merit.violation > LESS_VIOLATION * (known.violation + SMALL_OBJECTIVE)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn merit(violation: f64, objective: f64) -> Merit {
        Merit { violation, objective }
    }

    #[test]
    fn slow_progress_is_a_gain_once_it_adds_up_to_a_thousandth() {
        // In 1000 steps of a hundred thousandth the objective falls to (1 - 1e-5)^1000 = 0.990; ten decreases by a
        // thousandth fit into that, the last of them not quite.
        for violation in [false, true] {
            let at = |level: f64| if violation { merit(level, 0.0) } else { merit(0.0, level) };
            let (mut level, mut known, mut gains) = (1.0, at(1.0), 0);
            for _ in 0..1000 {
                level *= 1.0 - 1e-5;
                if is_gain(&at(level), &known) {
                    (known, gains) = (at(level), gains + 1);
                }
            }
            assert_eq!(gains, 9, "{violation}");
        }
    }

    #[test]
    fn feasibility_counts_before_the_objective_and_a_failed_point_is_never_a_gain() {
        assert!(is_gain(&merit(0.0, 5.0), &merit(0.1, 5.0)) && !is_gain(&merit(0.1, 1.0), &merit(0.0, 5.0)));
        assert!(is_gain(&merit(3.0, f64::INFINITY), &Merit::FAILED) && !is_gain(&Merit::FAILED, &Merit::FAILED));
    }
}
