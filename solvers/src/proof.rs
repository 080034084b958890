//! Cost of confirming an optimum, limited in proportion to the cost of finding it.

use mops_core::{Basins, Merit, Oracle};

/// Evaluations that a search has spent up to its last gain, and since then.
///
/// Only further search confirms the best point of a search. What it may cost without a gain is proportional to the cost of the
/// last gain: an optimum that was cheap to find is cheap to confirm.
#[derive(Debug, Clone, Copy, Default)]
pub struct Proof {
    /// Evaluations that the oracle allowed at the beginning of the search.
    granted: usize,
    /// Evaluations up to the last gain.
    to_gain: usize,
    /// Merit at the last gain.
    merit: Option<Merit>,
}

/// Factor on the cost of the last gain where the best point is shown to be stationary and no other optimum is known.
///
/// With 3, `auto` solves as many problems of the suites `minimax`, `hock-schittkowski` and `control` as without a limit; with 2, it
/// loses one of `control`.
pub const STATIONARY: usize = 3;

/// The same factor elsewhere: at kinks, at jumps and in narrow curved valleys, local searches end anywhere. With 20, one of
/// five searches for the shortest settling time under a limit of the overshoot ends elsewhere.
pub const NOT_SHOWN: usize = 60;

/// Number of evaluations per coordinate, and one coordinate more, that a gain is taken to cost at least.
const LEAST_COST: usize = 10;

impl Proof {
    /// Creates the state at the beginning of a search.
    pub fn begin(oracle: &dyn Oracle) -> Self {
        Self { granted: oracle.remaining(), to_gain: 0, merit: None }
    }

    /// Takes the best point into account; returns true if it is a gain.
    pub fn observe(&mut self, oracle: &dyn Oracle) -> bool {
        let Some(merit) = oracle.best().map(|best| best.merit) else { return false };
        let is_gain = self.merit.is_none_or(|known| is_gain(&merit, &known));
        if is_gain {
            (self.merit, self.to_gain) = (Some(merit), self.granted - oracle.remaining());
        }
        is_gain
    }

    /// Returns true if more than `factor` times the cost of the last gain has been spent since.
    pub fn is_spent(&self, oracle: &dyn Oracle, factor: usize) -> bool {
        let least = LEAST_COST * (oracle.shape().dimension() + 1);
        self.granted - oracle.remaining() - self.to_gain > factor * self.to_gain.max(least)
    }
}

/// Returns true if `merit` is better than `known` and belongs to another optimum.
pub fn is_gain(merit: &Merit, known: &Merit) -> bool {
    merit.is_better_than(known) && Basins::of(*known, &[*merit]).arrived == 0
}
