//! Tests of the integral of time and squared error.

use mops_criteria::itse::Itse;
use mops_math as math;

use crate::testing::{assert_near, bound, simulated, value};

fn itse() -> Itse {
    Itse { signal: "y".into(), target: Some(1.0.into()), ..Itse::default() }
}

#[test]
fn a_first_order_lag_has_a_quarter_of_its_time_constant_squared() {
    let (lag, ratio) = (simulated(12.0, |t| 1.0 - math::exp(-t / 3.0)), 8f64);
    assert_near(value(&itse(), &lag).number, 2.25 * (1.0 - math::exp(-ratio) * (1.0 + ratio)), 1e-12);
    assert_eq!(bound(&itse()).unit(), mops_language::Unit::known("m2 s2"));
}

#[test]
fn the_time_counts_from_the_step() {
    let late = simulated(42.0, |t| if t < 2.0 { 0.0 } else { 1.0 - math::exp(2.0 - t) });
    assert_near(value(&Itse { step_time: Some(2.0.into()), ..itse() }, &late).number, 0.25, 1e-12);
}
