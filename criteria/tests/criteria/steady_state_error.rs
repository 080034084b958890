//! Tests of the steady-state error.

use mops_core::Trace;
use mops_criteria::steady_state_error::SteadyStateError;
use mops_math as math;

use crate::testing::{analysis, assert_near, mistake, quantity, simulated, undefined, value};

fn steady(target: f64, window: Option<&str>) -> SteadyStateError {
    SteadyStateError { signal: "y".into(), target: target.into(), window: window.map(quantity) }
}

#[test]
fn a_first_order_lag_has_what_it_still_lacks_at_the_end() {
    let lag = simulated(5.0, |t| 1.0 - math::exp(-t));
    assert_near(value(&steady(1.0, None), &lag).number, math::exp(-5.0), 1e-14);
    // Mean of exp(-t) over [4, 5].
    assert_near(value(&steady(1.0, Some("1 s")), &lag).number, math::exp(-4.0) - math::exp(-5.0), 1e-13);
}

#[test]
fn a_window_of_whole_periods_averages_an_oscillation_out() {
    let ripple = simulated(10.0, |t| 2.1 + math::sin(std::f64::consts::TAU * t));
    assert_near(value(&steady(2.0, Some("3000 ms")), &ripple).number, 0.1, 1e-11);
}

#[test]
fn a_window_must_fit_into_the_simulation() {
    let still = simulated(2.0, |_| 1.0);
    assert_eq!(undefined(&steady(1.0, Some("5 s")), &still), "the window of 5 s is longer than the simulation of 2 s");
    assert_eq!(mistake(&steady(1.0, Some("0 s"))), "window: `window` must be positive, not 0 s");
}

#[test]
fn a_simulation_that_begins_later_has_the_length_that_is_left() {
    let mut trace = Trace::starting_at(1.0, 1);
    trace.push(3.0, [1.5; 5]);
    let late = analysis(&trace);
    assert_near(value(&steady(1.0, Some("2 s")), &late).number, 0.5, 1e-12);
    let why = undefined(&steady(1.0, Some("3 s")), &late);
    assert_eq!(why, "the window of 3 s is longer than the simulation of 2 s");
}
