//! Tests of the largest or smallest value of a signal.

use std::f64::consts::FRAC_PI_2;

use mops_criteria::peak::{Extremum, Peak};
use mops_math as math;

use crate::testing::{analysis, assert_near, sampled, simulated, value};

#[test]
fn the_peaks_of_a_decaying_oscillation_are_those_of_the_curve() {
    // exp(-t) sin(t) peaks at pi/4, then at pi/4 + pi.
    let swing = simulated(10.0, |t| math::exp(-t) * math::sin(t));
    let peak = |of| value(&Peak { signal: "y".into(), of }, &swing).number;
    let highest = math::exp(-0.5 * FRAC_PI_2) * 0.5f64.sqrt();
    assert_near(peak(Extremum::Maximum), highest, 1e-13);
    assert_near(peak(Extremum::Minimum), -highest * math::exp(-2.0 * FRAC_PI_2), 1e-13);
    assert_near(peak(Extremum::Absolute), highest, 1e-13);
}

#[test]
fn a_peak_between_the_knots_is_found() {
    // One segment, with knots at 0 and 2: the peak at 0.9 is at no node.
    let arch = analysis(&sampled(2.0, 1, |t| 4.0 - (t - 0.9) * (t - 0.9)));
    assert_near(value(&Peak { signal: "y".into(), of: Extremum::Maximum }, &arch).number, 4.0, 1e-14);
}
