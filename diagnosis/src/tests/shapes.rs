//! Shapes: of those that no fit moves the value that the screening likes best need not be the right one, and the data
//! may allow several; a wave along a rail need not be a whole number.

use std::f64::consts::TAU;

use mops_core::Input;
use mops_math as math;
use mops_outcome::diagnosis::StrengthValue;

use crate::testing::{Record, catalogue, integrated, study, subject};
use crate::{Options, diagnose};

/// A body that cools: `T' = -h (T - 20)`, on a scale whose zero the study does not say.
const BODY: &str = r#"
states     = { T = "1" }
parameters = { h = "1/s" }
der        = { T = "-h*(T - 20)" }
"#;
const RADIATED: f64 = 6e-11;

/// The strengths of the radiation found in a body that cools from these temperatures.
fn radiation(noise: f64, from: &[f64]) -> Vec<StrengthValue> {
    let cooled = |&start: &f64| {
        let fourth = |t: f64| math::powi(t + 273.15, 4);
        let rates = |_: f64, x: &[f64; 2]| [-0.01 * (x[0] - 20.0) - RADIATED * (fourth(x[0]) - fourth(20.0)), 0.0];
        Record::of_first("T", &integrated(rates, [start, 0.0], 1.0, 200), 1.0, noise, &format!("{start}"))
    };
    let subject = subject(BODY, &[0.02, 100.0], 1, from.iter().map(cooled).collect());
    let options = Options { max_effects: 1, level: 0.01, ..Options::default() };
    let diagnosis = diagnose(&study(&subject), &catalogue(&["radiation-loss"]), &options, &()).expect("it simulates");
    diagnosis.found.into_iter().next().expect("it is found").strengths
}

#[test]
fn of_shapes_that_no_fit_moves_the_one_that_fits_best_stays() {
    let found = radiation(0.001, &[98.0, 60.0]);
    let zero = &found[2];
    assert_eq!((zero.name.as_str(), zero.value, zero.interval95), ("zero", 273.15, None), "{found:?}");
    let [low, high] = found[0].interval95.expect("it has one");
    assert!(low < RADIATED && RADIATED < high && high - low < 0.1 * RADIATED, "{found:?}");
}

#[test]
fn where_the_data_allow_several_the_intervals_span_them() {
    let found = radiation(0.1, &[98.0, 60.0]);
    assert_eq!(found[2].interval95.map(|[low, _]| low < 293.15), Some(true), "{found:?}");
    let [low, high] = found[0].interval95.expect("it has one");
    assert!(low < RADIATED && RADIATED < high, "{found:?}");
}

#[test]
fn a_rail_is_worn_at_distances_of_its_own() {
    const SLEDGE: &str = r#"
        states     = { x = "m", v = "m/s" }
        parameters = { k = "1/s^2", d = "1/s" }
        der        = { x = "v", v = "v' = -k*x - d*v" }
    "#;
    const WAVES: f64 = 11.5;
    let slid = |start: f64| {
        let friction = |x: &[f64; 2]| 0.5 * (1.0 + 0.7 * math::cos(WAVES * x[0] + 0.4)) * math::tanh(x[1] / 1e-3);
        let rates = |_: f64, x: &[f64; 2]| [x[1], -30.0 * x[0] - 0.2 * x[1] - friction(x)];
        Record::of_first("x", &integrated(rates, [start, 0.0], 0.01, 300), 0.01, 1e-3, &format!("{start}"))
    };
    let mut subject = subject(SLEDGE, &[40.0, 0.4, 0.5, 0.0], 2, vec![slid(0.5), slid(0.4)]);
    for (measurement, start) in subject.measurements.iter_mut().zip([0.5, 0.4]) {
        measurement.locals[0].start = start;
    }
    let some = catalogue(&["coulomb-friction", "position-dependent-friction"]);
    let options = Options { max_effects: 1, level: 0.01, ..Options::default() };
    let found = diagnose(&study(&subject), &some, &options, &()).expect("it simulates").found;
    assert_eq!(found[0].effect, "position-dependent-friction");
    let waves = &found[0].strengths[2];
    let [low, high] = waves.interval95.expect("it has one");
    assert!(waves.name == "n" && low < WAVES && WAVES < high && high - low < 1.0, "{waves:?}");
}

#[test]
fn waves_of_a_linear_motor_are_looked_for_along_its_rail_whatever_the_unit_of_the_command() {
    const MOTOR: &str = r#"
        states     = { x = "m", v = "m/s" }
        inputs     = { u = "mV" }
        parameters = { k = "m/s^2", d = "1/s" }
        der        = { x = "v", v = "v' = k*u/1 [V] - 40 [1/s2]*x - d*v" }
    "#;
    const WAVES: f64 = 60.0;
    let driven = |frequency: f64| {
        let command = move |t: f64| 5.0 * math::sin(TAU * frequency * t);
        let ripple = |x: &[f64; 2]| 1.0 + 0.2 * math::sin(WAVES * x[0] + 0.7);
        let rates = |t: f64, x: &[f64; 2]| [x[1], 0.6 * command(t) * ripple(x) - 40.0 * x[0] - 2.0 * x[1]];
        let mut record =
            Record::of_first("x", &integrated(rates, [0.0, 0.0], 0.01, 400), 0.01, 1e-4, &frequency.to_string());
        record.inputs = vec![("u", Input::Sine { amplitude: 5000.0, frequency, phase: 0.0, offset: 0.0 })];
        record
    };
    let subject = subject(MOTOR, &[0.5, 1.5, 0.0, 0.0], 2, vec![driven(0.9), driven(0.5)]);
    let some = catalogue(&["input-gain", "torque-ripple", "quadratic-input"]);
    let options = Options { max_effects: 1, level: 0.01, ..Options::default() };
    let found = diagnose(&study(&subject), &some, &options, &()).expect("it simulates").found;
    assert_eq!(found[0].effect, "torque-ripple");
    let waves = &found[0].strengths[1];
    assert!(waves.name == "n" && (waves.value / WAVES - 1.0).abs() < 0.02, "{waves:?}");
}
