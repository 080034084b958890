//! Tests of the integral of the absolute error.

use mops_criteria::iae::Iae;
use mops_math as math;

use crate::testing::{assert_near, bound, simulated, value};

fn iae() -> Iae {
    Iae { signal: "y".into(), target: Some(1.0.into()), ..Iae::default() }
}

#[test]
fn a_first_order_lag_has_its_time_constant() {
    let (lag, length) = (simulated(12.0, |t| 1.0 - math::exp(-t / 3.0)), 12.0f64);
    assert_near(value(&iae(), &lag).number, 3.0 * (1.0 - math::exp(-length / 3.0)), 1e-12);
    assert_eq!(bound(&iae()).unit(), mops_language::Unit::known("m s"));
}

#[test]
fn an_oscillation_counts_on_both_sides() {
    let swing = simulated(40.0, |t| 1.0 + math::exp(-t) * math::sin(t));
    assert_near(value(&iae(), &swing).number, 0.5 / math::tanh(std::f64::consts::FRAC_PI_2), 1e-12);
}

#[test]
fn without_a_target_the_last_value_is_it() {
    let lag = simulated(60.0, |t| 5.0 - 2.0 * math::exp(-t));
    assert_near(value(&Iae { target: None, ..iae() }, &lag).number, 2.0, 1e-12);
}
