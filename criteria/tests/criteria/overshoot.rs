//! Tests of the overshoot of a step response.

use std::f64::consts::PI;

use mops_criteria::overshoot::Overshoot;
use mops_language::Unit;
use mops_math as math;

use crate::testing::{assert_near, bound, quantity, second_order, simulated, undefined, value};

fn overshoot() -> Overshoot {
    Overshoot { signal: "y".into(), target: Some(1.0.into()), ..Overshoot::default() }
}

#[test]
fn a_second_order_system_overshoots_by_its_closed_form() {
    for damping in [0.1, 0.3, 0.5, 0.7, 0.9] {
        let exact = math::exp(-PI * damping / f64::sqrt(1.0 - damping * damping));
        assert_near(value(&overshoot(), &simulated(20.0, second_order(damping))).number, exact, 1e-11);
    }
}

#[test]
fn a_step_downwards_and_later_overshoots_as_much_as_one_upwards_from_zero() {
    let response = second_order(0.3);
    let down = simulated(25.0, |t| if t < 5.0 { 40.0 } else { 40.0 - 2.0 * response(t - 5.0) });
    let exact = math::exp(-PI * 0.3 / f64::sqrt(0.91));
    let mut options = Overshoot { target: Some(38.0.into()), step_time: Some(quantity("5 s")), ..overshoot() };
    assert_near(value(&options, &down).number, exact, 1e-11);
    options.absolute = true;
    assert_near(value(&options, &down).number, 2.0 * exact, 1e-11);
    assert_eq!((bound(&options).unit(), bound(&overshoot()).unit()), (Unit::known("m"), Unit::one()));
}

#[test]
fn a_response_that_never_goes_beyond_has_none() {
    assert_eq!(value(&overshoot(), &simulated(5.0, |t| 1.0 - math::exp(-t))).number, 0.0);
}

#[test]
fn a_signal_that_should_stay_has_an_absolute_overshoot_only() {
    let swing = simulated(10.0, |t| t * math::exp(-t));
    let mut options = Overshoot { target: Some(0.0.into()), ..overshoot() };
    assert_eq!(undefined(&options, &swing), "the step from 0 to 0 has no height");
    options.absolute = true;
    assert_near(value(&options, &swing).number, math::exp(-1.0), 1e-12);
}

#[test]
fn without_a_target_the_last_value_is_it() {
    let options = Overshoot { target: None, ..overshoot() };
    let exact = math::exp(-PI * 0.5 / f64::sqrt(0.75));
    assert_near(value(&options, &simulated(80.0, |t| 3.0 * second_order(0.5)(t))).number, exact, 1e-11);
}
