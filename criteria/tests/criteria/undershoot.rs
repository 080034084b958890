//! Tests of the undershoot of a step response: its largest excursion in the wrong direction.

use mops_criteria::undershoot::Undershoot;
use mops_math as math;

use crate::testing::{assert_near, second_order, simulated, value};

/// Returns the step response of `(1 - s)/(s + 1)^2`: smallest at t = 1/2.
fn inverse(t: f64) -> f64 {
    1.0 - (1.0 + 2.0 * t) * math::exp(-t)
}

fn undershoot(target: f64) -> Undershoot {
    Undershoot { signal: "y".into(), target: Some(target.into()), ..Undershoot::default() }
}

#[test]
fn an_inverse_response_undershoots_by_its_closed_form() {
    let exact = 2.0 * math::exp(-0.5) - 1.0;
    assert_near(value(&undershoot(1.0), &simulated(10.0, inverse)).number, exact, 1e-12);
    assert_near(value(&undershoot(-3.0), &simulated(10.0, |t| -3.0 * inverse(t))).number, exact, 1e-12);
    let absolute = Undershoot { absolute: true, ..undershoot(-3.0) };
    assert_near(value(&absolute, &simulated(10.0, |t| -3.0 * inverse(t))).number, 3.0 * exact, 1e-12);
}

#[test]
fn a_response_that_starts_the_right_way_has_none() {
    assert_near(value(&undershoot(1.0), &simulated(10.0, second_order(0.2))).number, 0.0, 1e-15);
}
