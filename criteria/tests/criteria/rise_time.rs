//! Tests of the rise time of a step response.

use mops_core::criterion::Missed;
use mops_criteria::rise_time::RiseTime;
use mops_math as math;

use crate::testing::{assert_near, mistake, second_order, simulated, value};

fn rise() -> RiseTime {
    RiseTime { signal: "y".into(), target: Some(1.0.into()), ..RiseTime::default() }
}

#[test]
fn a_first_order_lag_rises_in_its_time_constant_times_the_logarithm_of_nine() {
    let lag = simulated(20.0, |t| 1.0 - math::exp(-t / 2.0));
    assert_near(value(&rise(), &lag).number, 2.0 * math::ln(9.0), 1e-10);
}

#[test]
fn an_oscillation_first_reaches_its_target_by_the_closed_form() {
    let whole = RiseTime { low: Some(0.0.into()), high: Some(1.0.into()), ..rise() };
    for damping in [0.1f64, 0.5, 0.8] {
        let exact = (std::f64::consts::PI - math::acos(damping)) / (1.0 - damping * damping).sqrt();
        assert_near(value(&whole, &simulated(20.0, second_order(damping))).number, exact, 1e-10);
    }
}

#[test]
fn a_step_downwards_and_later_rises_just_as_fast() {
    let down = simulated(20.0, |t| if t < 3.0 { 1.0 } else { math::exp(3.0 - t) });
    let options = RiseTime { target: Some(0.0.into()), step_time: Some(3.0.into()), ..rise() };
    assert_near(value(&options, &down).number, math::ln(9.0), 1e-10);
}

#[test]
fn a_response_that_stays_low_has_not_risen_and_is_the_better_the_nearer_it_comes() {
    let low = RiseTime { from: Some(0.0.into()), ..rise() };
    let at = |level: f64| value(&low, &simulated(10.0, move |_| level));
    assert_near(at(0.5).number, 10.0 * (1.0 + 0.4 / 0.41), 1e-9);
    assert!(at(0.8).number < at(0.5).number && at(-3.0).number > at(0.5).number);
    assert_eq!((at(0.5).missed, at(0.5).note), (Some(Missed { horizon: Some(10.0) }), Some("not risen at the end")));
}

#[test]
fn fractions_out_of_order_are_a_mistake() {
    let reversed = RiseTime { low: Some(0.9.into()), high: Some(0.1.into()), ..rise() };
    assert!(mistake(&reversed).starts_with("high: a rise from 0.9 to 0.1 of the step is impossible"));
    assert!(mistake(&RiseTime { low: Some((-0.1).into()), ..rise() }).starts_with("low: "));
}
