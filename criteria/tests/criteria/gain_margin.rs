//! Tests of the gain margin of a feedback loop.

use mops_criteria::gain_margin::GainMargin;
use mops_math as math;

use crate::testing::{assert_near, linear, linear_delayed, undefined, value};

#[test]
fn the_margin_of_a_third_order_lag_has_its_closed_form() {
    // k/(s + 1)^3 is -k/8 at w = sqrt 3.
    for k in [0.5f64, 4.0, 7.0, 9.0] {
        let margin = value(&GainMargin::default(), &linear(&[k], &[1.0, 3.0, 3.0, 1.0])).number;
        assert_near(margin, 20.0 * math::log10(8.0 / k), 1e-10);
    }
}

#[test]
fn the_margin_of_a_delayed_integrator_has_its_closed_form_and_one_without_crossing_is_capped() {
    // exp(-s T)/s: pi/(2 T).
    let late = value(&GainMargin::default(), &linear_delayed(&[1.0], &[1.0, 0.0], 0.2)).number;
    assert_near(late, 20.0 * math::log10(std::f64::consts::PI / 0.4), 1e-9);
    let never = value(&GainMargin::default(), &linear(&[1.0], &[1.0, 1.0]));
    assert_eq!((never.number, never.note), (200.0, Some("infinite or above the limit")));
}

#[test]
fn a_margin_between_60_and_200_decibels_is_no_infinite_one() {
    // k exp(-s T)/s: pi/(2 k T).
    for (k, delay) in [(1e-3, 0.5), (1e-5, 2.0), (1e-9, 0.3)] {
        let margin = value(&GainMargin::default(), &linear_delayed(&[k], &[1.0, 0.0], delay));
        assert_near(margin.number, 20.0 * math::log10(std::f64::consts::FRAC_PI_2 / (k * delay)), 1e-8);
        assert!(margin.note.is_none());
    }
}

#[test]
fn an_unstable_loop_has_the_change_that_makes_it_stable_or_no_value() {
    // k/(s + 1)^3 is stable up to k = 8; k/(s - 1) from 1 on; k/(s (s - 1)) never.
    let margin =
        |numerator: &[f64], denominator: &[f64]| value(&GainMargin::default(), &linear(numerator, denominator)).number;
    assert_near(margin(&[800.0], &[1.0, 3.0, 3.0, 1.0]), -40.0, 1e-9);
    assert_near(margin(&[0.01], &[1.0, -1.0]), -40.0, 1e-9);
    assert!(undefined(&GainMargin::default(), &linear(&[1.0], &[1.0, -1.0, 0.0])).contains("no gain change"));
}
