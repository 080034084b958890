//! Tests of the maximum sensitivity of a feedback loop.

use mops_criteria::maximum_sensitivity::MaximumSensitivity;

use crate::testing::{assert_near, linear, linear_delayed, undefined, value};

#[test]
fn the_peak_of_an_integrator_with_delay_has_the_value_of_another_computation() {
    // exp(-s/2)/s: the minimum of |1 + L| on a grid of 2e7 frequencies (NumPy).
    let peak = value(&MaximumSensitivity::default(), &linear_delayed(&[1.0], &[1.0, 0.0], 0.5)).number;
    assert_near(peak, 1.590_490_233_19, 1e-8);
}

#[test]
fn one_lag_has_no_peak_and_an_unstable_loop_no_value() {
    assert_near(value(&MaximumSensitivity::default(), &linear(&[3.0], &[1.0, 1.0])).number, 1.0, 1e-9);
    let unstable = undefined(&MaximumSensitivity::default(), &linear(&[9.0], &[1.0, 3.0, 3.0, 1.0]));
    assert_eq!(unstable, "the closed loop is not stable");
}
