//! Summary of the local searches of a solver.

use schemars::JsonSchema;
use serde::Serialize;

use super::optimality::SMALL_OBJECTIVE;
use crate::evaluation::Merit;

/// Ends of local searches from different starting points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Basins {
    /// Number of local searches that have ended; 0 if the solver makes none.
    pub searches: usize,
    /// Number of these searches that ended within a thousandth of the best objective.
    pub arrived: usize,
    /// Number of values, a thousandth apart, at which these searches ended.
    pub optima: usize,
    /// Expected share of the starting points that lead to an optimum not yet seen, `w (w + 1)/(n (n - 1))` for `w`
    /// optima in `n` searches; null if `n < w + 2`, where the estimate is 1 whatever the searches found.
    ///
    /// Source: C. G. E. Boender, A. H. G. Rinnooy Kan, Mathematical Programming 37 (1987) 59-80.
    pub unseen: Option<f64>,
}

/// Difference of two objectives, relative to the larger one plus [`SMALL_OBJECTIVE`], up to which they belong to the
/// same optimum.
const SAME: f64 = 1e-3;

/// Expected share of starting points that lead to an unseen optimum, below which another basin is unlikely: 1 optimum
/// in 4 searches, 2 in 7.
const UNLIKELY: f64 = 0.2;

/// Expected share from which another basin is likely: 2 optima in 4 searches, 3 in 6, 4 in 7.
const LIKELY: f64 = 0.4;

impl Basins {
    /// Returns the summary of searches that have ended with the given merits, where the best known merit is `best`.
    #[must_use]
    pub fn of(best: Merit, ends: &[Merit]) -> Self {
        let is_same = |a: f64, b: f64| (a - b).abs() <= SAME * (a.abs().max(b.abs()) + SMALL_OBJECTIVE);
        let arrived = ends.iter().filter(|end| end.is_feasible() && is_same(end.objective, best.objective)).count();
        let mut values: Vec<f64> = ends.iter().filter(|end| end.is_feasible()).map(|end| end.objective).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|later, earlier| is_same(*later, *earlier));
        // All infeasible ends count as one optimum.
        let optima = values.len() + usize::from(ends.iter().any(|end| !end.is_feasible()));
        #[allow(clippy::cast_precision_loss)]
        let [n, w] = [ends.len() as f64, optima as f64];
        let unseen = (ends.len() >= optima + 2).then(|| w * (w + 1.0) / (n * (n - 1.0)));
        Self { searches: ends.len(), arrived, optima, unseen }
    }

    /// Returns true if two searches ended at the best objective and another optimum is unlikely.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.arrived > 1 && self.unseen.is_some_and(|share| share < UNLIKELY)
    }

    /// Returns true if a single search of several ended at the best objective, or another optimum is likely: by its
    /// expected share, or as nearly every search ended in an optimum of its own.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        let is_likely = self.unseen.map_or(self.optima > 1, |share| share >= LIKELY);
        self.searches > 1 && (self.arrived < 2 || is_likely)
    }
}
