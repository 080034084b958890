//! Tests of the control effort.

use std::f64::consts::TAU;

use mops_criteria::control_effort::{ControlEffort, Effort};
use mops_language::Unit;
use mops_math as math;

use crate::testing::{assert_near, bound, quantity, simulated, value};

#[test]
fn a_sinusoid_about_its_resting_value_has_the_effort_of_a_sinusoid() {
    let period = simulated(TAU, |t| 2.0 + 3.0 * math::sin(t));
    let square = ControlEffort { signal: "u".into(), offset: Some(quantity("2000 mV")), ..ControlEffort::default() };
    assert_near(value(&square, &period).number, 4.5 * TAU, 1e-10);
    let absolute = ControlEffort { of: Effort::Absolute, ..square.clone() };
    assert_near(value(&absolute, &period).number, 12.0, 1e-10);
    assert_eq!((bound(&square).unit(), bound(&absolute).unit()), (Unit::known("V2 s"), Unit::known("V s")));
}

#[test]
fn without_an_offset_the_signal_itself_is_integrated() {
    let decay = simulated(30.0, |t| -2.0 * math::exp(-t));
    let effort = |of| value(&ControlEffort { signal: "u".into(), of, offset: None }, &decay).number;
    assert_near(effort(Effort::Square), 2.0, 1e-12);
    assert_near(effort(Effort::Absolute), 2.0, 1e-12);
}
