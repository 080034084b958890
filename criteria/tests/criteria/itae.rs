//! Tests of the integral of time and absolute error.

use mops_criteria::itae::Itae;
use mops_math as math;

use crate::testing::{assert_near, bound, simulated, value};

fn itae() -> Itae {
    Itae { signal: "y".into(), target: Some(1.0.into()), ..Itae::default() }
}

#[test]
fn a_first_order_lag_has_its_time_constant_squared() {
    let (lag, ratio) = (simulated(12.0, |t| 1.0 - math::exp(-t / 3.0)), 4f64);
    assert_near(value(&itae(), &lag).number, 9.0 * (1.0 - math::exp(-ratio) * (1.0 + ratio)), 1e-12);
    assert_eq!(bound(&itae()).unit(), mops_language::Unit::known("m s2"));
}

#[test]
fn the_time_counts_from_the_step() {
    let late = simulated(42.0, |t| if t < 2.0 { 0.0 } else { 1.0 - math::exp(2.0 - t) });
    assert_near(value(&Itae { step_time: Some(2.0.into()), ..itae() }, &late).number, 1.0, 1e-11);
}
