//! Tests of the deviation of a step response from that of a reference model.

use mops_criteria::model_tracking::ModelTracking;
use mops_math as math;

use crate::testing::{analysis, assert_near, mistake, quantity, sampled, second_order, simulated, value};

fn first(time_constant: f64) -> ModelTracking {
    ModelTracking { signal: "y".into(), time_constant: Some(time_constant.into()), ..ModelTracking::default() }
}

fn second_order_reference(frequency: &str, damping: f64) -> ModelTracking {
    ModelTracking {
        signal: "y".into(),
        from: Some(0.0.into()),
        frequency: Some(quantity(frequency)),
        damping: Some(damping.into()),
        ..ModelTracking::default()
    }
}

#[test]
fn a_response_equal_to_its_reference_is_at_no_distance() {
    assert_near(value(&first(2.0), &simulated(10.0, |t| 1.0 - math::exp(-t / 2.0))).number, 0.0, 1e-12);
    let oscillation = second_order_reference("1 rad/s", 0.3);
    assert_near(value(&oscillation, &simulated(30.0, second_order(0.3))).number, 0.0, 1e-12);
    // Critical damping, and poles at 1 and 4 rad/s: frequency 2, damping 1.25; downwards, 3 s late.
    let critical = simulated(20.0, |t| 1.0 - (1.0 + 2.0 * t) * math::exp(-2.0 * t));
    assert_near(value(&second_order_reference("2 rad/s", 1.0), &critical).number, 0.0, 1e-12);
    let two_poles = |t: f64| 1.0 - (4.0 * math::exp(-t) - math::exp(-4.0 * t)) / 3.0;
    let down = simulated(20.0, |t| if t < 3.0 { 7.0 } else { 7.0 - 2.0 * two_poles(t - 3.0) });
    let overdamped = ModelTracking {
        target: 5.0.into(),
        from: None,
        step_time: Some(3.0.into()),
        ..second_order_reference("2 rad/s", 1.25)
    };
    assert_near(value(&overdamped, &down).number, 0.0, 1e-12);
}

#[test]
fn a_reference_much_faster_than_the_steps_of_the_simulation_is_integrated_exactly() {
    // y = 1 throughout, in one step: the difference is exp(-t/T), its mean square T/2/length.
    let one = analysis(&sampled(60.0, 1, |_| 1.0));
    let fast = ModelTracking { from: Some(0.0.into()), ..first(0.01) };
    assert_near(value(&fast, &one).number, f64::sqrt(0.005 / 60.0), 1e-13);
    // Poles a = 100 and b = 0.01 rad/s: the difference is (a exp(-b t) - b exp(-a t))/(a - b).
    let [a, b, length] = [100.0f64, 0.01, 3000.0];
    let still = analysis(&sampled(length, 1, |_| 1.0));
    let apart = second_order_reference("1 rad/s", 0.5 * (a + b));
    let integral = (a * a / (2.0 * b) - 2.0 * a * b / (a + b) + b * b / (2.0 * a)) / math::powi(a - b, 2);
    assert_near(value(&apart, &still).number, (integral / length).sqrt(), 1e-11);
    // (1 - y_ref)^2 with damping z integrates to (1 + 4 z^2)/(4 z w).
    let ringing = second_order_reference("20 rad/s", 0.1);
    assert_near(value(&ringing, &one).number, f64::sqrt(1.04 / (0.4 * 20.0) / 60.0), 1e-11);
}

#[test]
fn a_reference_is_of_one_order_and_well_damped() {
    assert!(
        mistake(&ModelTracking { signal: "y".into(), ..ModelTracking::default() }).contains("missing or ambiguous")
    );
    let both = ModelTracking { time_constant: Some(1.0.into()), ..second_order_reference("1 rad/s", 0.7) };
    assert!(mistake(&both).contains("give either `time-constant`"));
    assert!(mistake(&second_order_reference("1 rad/s", 0.01)).starts_with("damping: a damping of 0.01 is below"));
    assert_eq!(mistake(&first(-1.0)), "time-constant: `time-constant` must be positive, not -1 s");
}

#[test]
fn a_reference_with_the_least_damping_is_allowed() {
    let ringing = second_order_reference("1 rad/s", 0.05);
    assert_near(value(&ringing, &simulated(100.0, second_order(0.05))).number, 0.0, 1e-9);
}
