//! Tests of the maximum complementary sensitivity of a feedback loop.

use mops_criteria::maximum_complementary_sensitivity::MaximumComplementarySensitivity;

use crate::testing::{assert_near, linear, linear_delayed, value};

#[test]
fn with_an_integrator_it_is_one_at_least_however_low_the_gain_and_whatever_the_delay() {
    for (k, delay) in [(0.1, 0.2), (1e-3, 2.0), (1e-6, 0.01), (1e-9, 5.0)] {
        let loops = [linear_delayed(&[k], &[1.0, 0.0], delay), linear_delayed(&[k], &[1.0, 8.0, 20.0, 0.0], delay)];
        for l in loops {
            assert_near(value(&MaximumComplementarySensitivity::default(), &l).number, 1.0, 1e-12);
        }
    }
}

#[test]
fn the_peak_of_the_second_order_loop_has_its_closed_form() {
    // w^2/(s (s + 2 z w)): 1/(2 z sqrt(1 - z^2)).
    for z in [0.05f64, 0.3, 0.6] {
        let peak = value(&MaximumComplementarySensitivity::default(), &linear(&[9.0], &[1.0, 6.0 * z, 0.0])).number;
        assert_near(peak, 0.5 / (z * (1.0 - z * z).sqrt()), 1e-7);
    }
}
