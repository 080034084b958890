//! Tests of the delay time of a step response.

use mops_core::criterion::Missed;
use mops_criteria::delay_time::DelayTime;
use mops_math as math;

use crate::testing::{assert_near, mistake, simulated, value};

fn delay() -> DelayTime {
    DelayTime { signal: "y".into(), target: Some(1.0.into()), ..DelayTime::default() }
}

#[test]
fn a_first_order_lag_is_half_way_after_its_half_life() {
    let lag = simulated(20.0, |t| 1.0 - math::exp(-t / 3.0));
    assert_near(value(&delay(), &lag).number, 3.0 * math::ln(2.0), 1e-10);
    let level = DelayTime { level: Some(0.632.into()), ..delay() };
    assert_near(value(&level, &lag).number, -3.0 * math::ln(0.368), 1e-10);
}

#[test]
fn a_response_that_does_not_get_there_is_noted() {
    let low = simulated(7.0, |t| 0.4 * (1.0 - math::exp(-t)));
    let missed = value(&delay(), &low);
    // The distance is 0.1 below the level, and slightly more because the response still approaches its final value.
    let rest = 0.4 * (math::exp(-6.3) - math::exp(-7.0)) / 0.7;
    assert_near(missed.number, 7.0 * (1.0 + (0.1 + rest) / (0.11 + rest)), 1e-9);
    assert_eq!((missed.missed, missed.note), (Some(Missed { horizon: Some(7.0) }), Some("level not reached")));
}

#[test]
fn a_level_outside_the_step_is_a_mistake() {
    let beyond = DelayTime { level: Some(1.5.into()), ..delay() };
    assert_eq!(mistake(&beyond), "level: `level` must be above 0 and at most 1, not 1.5");
}
