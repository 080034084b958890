//! Tests of the root mean square difference from a measurement.

use mops_criteria::rmse::Rmse;
use mops_language::Unit;

use crate::testing::{assert_near, bound, measured, simulated, value_in};

#[test]
fn the_root_of_the_mean_square_is_that_of_hand_computed_differences() {
    // Differences 1, -1, 2, 0.
    let case = measured(&[0.0, 0.5, 1.7, 3.0], &[-1.0, 1.5, -0.3, 3.0], None);
    let rmse = Rmse { signal: "y".into() };
    let value = value_in(&case, &rmse, &simulated(3.0, |t| t));
    assert_near(value.number, 1.5f64.sqrt(), 1e-12);
    assert!(value.residuals.is_empty());
    assert_eq!(bound(&rmse).unit(), Unit::known("m"));
}
