//! Tests of the value of a signal at the end.

use mops_criteria::final_value::FinalValue;
use mops_language::Unit;
use mops_math as math;

use crate::testing::{assert_near, bound, mistake, simulated, value};

#[test]
fn the_value_at_the_end_is_that_of_the_curve() {
    let last = FinalValue { signal: "u".into() };
    assert_near(value(&last, &simulated(4.0, math::cos)).number, math::cos(4.0), 1e-14);
    assert_eq!((bound(&last).unit(), bound(&last).signals()), (Unit::known("V"), vec!["u".to_owned()]));
}

#[test]
fn a_signal_that_is_not_there_is_a_mistake() {
    let unknown = FinalValue { signal: "speed".into() };
    assert_eq!(mistake(&unknown), "signal: the model has no signal `speed`; known: y, u, phi");
}
