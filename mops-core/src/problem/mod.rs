//! The weighted min-max problem of a study over the unit box.

mod evaluator;
mod known;
mod minimax;
mod objectives;
mod prediction;

pub use evaluator::Evaluator;
pub use known::{CachedGradients, CachedPoint, JobValues, Known, RowSlopes, RowValue, Store};
pub use objectives::FrontObjective;
pub use prediction::SignalSlopes;

pub use minimax::{Problem, Slopes};

#[cfg(test)]
mod tests {
    use crate::evaluation::Merit;

    #[test]
    fn feasible_points_come_first_then_small_violations_then_failures() {
        let merit = |violation, objective| Merit { violation, objective };
        assert!(merit(0.0, 5.0).is_better_than(&merit(0.1, 1.0)));
        assert!(merit(0.0, 1.0).is_better_than(&merit(1e-7, 2.0)));
        assert!(merit(0.1, 9.0).is_better_than(&merit(0.2, 1.0)));
        assert!(merit(9.0, 9.0).is_better_than(&Merit::FAILED));
        assert!(!Merit::FAILED.is_better_than(&Merit::FAILED));
    }
}
