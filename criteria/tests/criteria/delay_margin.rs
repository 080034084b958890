//! Tests of the delay margin of a feedback loop.

use mops_criteria::delay_margin::DelayMargin;

use crate::testing::{assert_near, linear, linear_delayed, value};

#[test]
fn the_margin_of_an_integrator_has_its_closed_form_and_a_delay_uses_it_up() {
    // k/s: pi/(2 k).
    let margin = value(&DelayMargin::default(), &linear(&[4.0], &[1.0, 0.0])).number;
    assert_near(margin, std::f64::consts::FRAC_PI_2 / 4.0, 1e-13);
    let left = value(&DelayMargin::default(), &linear_delayed(&[4.0], &[1.0, 0.0], 0.5)).number;
    assert_near(left, std::f64::consts::FRAC_PI_2 / 4.0 - 0.5, 1e-12);
    let late = value(&DelayMargin::default(), &linear_delayed(&[4.0], &[1.0, 0.0], 9.0)).number;
    assert_near(late, std::f64::consts::FRAC_PI_2 / 4.0 - 9.0, 1e-11);
    let never = value(&DelayMargin::default(), &linear(&[0.5], &[1.0, 1.0]));
    assert_eq!(never.number, 1e6);
}
