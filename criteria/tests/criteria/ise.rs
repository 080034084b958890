//! Tests of the integral of the squared error.

use mops_criteria::ise::Ise;
use mops_math as math;

use crate::testing::{assert_near, bound, simulated, value};

fn ise() -> Ise {
    Ise { signal: "y".into(), target: Some(1.0.into()), ..Ise::default() }
}

#[test]
fn a_first_order_lag_has_half_its_time_constant() {
    let (lag, length) = (simulated(12.0, |t| 1.0 - math::exp(-t / 3.0)), 12.0f64);
    assert_near(value(&ise(), &lag).number, 1.5 * (1.0 - math::exp(-2.0 * length / 3.0)), 1e-12);
    assert_eq!(bound(&ise()).unit(), mops_language::Unit::known("m2 s"));
}

#[test]
fn what_comes_before_the_step_does_not_count() {
    let late = simulated(42.0, |t| if t < 2.0 { 0.0 } else { 1.0 - math::exp(2.0 - t) });
    assert_near(value(&Ise { step_time: Some(2.0.into()), ..ise() }, &late).number, 0.5, 1e-12);
    assert_near(value(&ise(), &late).number, 2.5, 1e-12);
}
