//! Tests of the fit to a measurement, in percent.

use mops_criteria::fit_percent::FitPercent;

use crate::testing::{assert_near, measured, simulated, undefined_in, value_in};

fn fit() -> FitPercent {
    FitPercent { signal: "y".into() }
}

#[test]
fn a_perfect_fit_is_a_hundred_percent_and_the_mean_is_zero() {
    let case = measured(&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.0, 2.0, 3.0], None);
    assert_near(value_in(&case, &fit(), &simulated(3.0, |t| t)).number, 100.0, 1e-10);
    assert_near(value_in(&case, &fit(), &simulated(3.0, |_| 1.5)).number, 0.0, 1e-10);
    // Differences of 0.5 against a variation of 5: 100 (1 - 1/sqrt(5)).
    let offset = value_in(&case, &fit(), &simulated(3.0, |t| t + 0.5)).number;
    assert_near(offset, 100.0 * (1.0 - 0.2f64.sqrt()), 1e-10);
}

#[test]
fn a_constant_measurement_has_no_fit() {
    let why = undefined_in(&measured(&[0.0, 1.0], &[0.1, 0.1], None), &fit(), &simulated(1.0, |t| t));
    assert_eq!(why, "the measurement of `y` is constant, so that the fit is undefined");
}
