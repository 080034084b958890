//! Tests of the phase margin of a feedback loop.

use mops_criteria::phase_margin::PhaseMargin;
use mops_math as math;

use crate::testing::{assert_near, linear, linear_delayed, undefined, value};

#[test]
fn the_margin_of_the_second_order_loop_has_its_closed_form() {
    // w^2/(s (s + 2 z w)): atan(2 z/sqrt(sqrt(1 + 4 z^4) - 2 z^2)).
    for z in [0.1f64, 0.5, 0.9] {
        let margin = value(&PhaseMargin::default(), &linear(&[9.0], &[1.0, 6.0 * z, 0.0])).number;
        let exact = math::atan(2.0 * z / ((1.0 + 4.0 * math::powi(z, 4)).sqrt() - 2.0 * z * z).sqrt());
        assert_near(margin, exact, 1e-11);
    }
}

#[test]
fn a_delay_takes_its_part_until_nothing_is_left() {
    let margin = |delay| value(&PhaseMargin::default(), &linear_delayed(&[1.0], &[1.0, 0.0], delay)).number;
    assert_near(margin(0.3), std::f64::consts::FRAC_PI_2 - 0.3, 1e-12);
    assert_near(margin(1.7), std::f64::consts::FRAC_PI_2 - 1.7, 1e-12);
    // Phase shift to the stability limit, also beyond half a turn.
    assert_near(margin(20.0), std::f64::consts::FRAC_PI_2 - 20.0, 1e-11);
}

#[test]
fn a_loop_that_no_phase_shift_stabilises_has_no_value() {
    let slow = undefined(&PhaseMargin::default(), &linear(&[0.5], &[1.0, -1.0]));
    assert_eq!(slow, "the closed loop is unstable, and no phase shift stabilises it");
}
