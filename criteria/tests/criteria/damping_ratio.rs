//! Tests of the smallest damping ratio of all poles.

use mops_criteria::Of;
use mops_criteria::damping_ratio::DampingRatio;

use crate::testing::{assert_near, linear, value};

#[test]
fn the_least_damped_pole_counts_whichever_its_speed() {
    // (s + 9)(s^2 + 2 s + 100): 0.1.
    let poles = [1.0, 11.0, 118.0, 900.0];
    assert_near(value(&DampingRatio::default(), &linear(&[1.0], &poles)).number, 0.1, 1e-13);
    assert_near(value(&DampingRatio::default(), &linear(&[1.0], &[1.0, -1.0, 100.0])).number, -0.05, 1e-13);
}

#[test]
fn the_closed_loop_of_a_second_order_loop_has_its_damping() {
    let closed = DampingRatio { of: Of::ClosedLoop, ..DampingRatio::default() };
    assert_near(value(&closed, &linear(&[9.0], &[1.0, 6.0 * 0.3, 0.0])).number, 0.3, 1e-13);
}
