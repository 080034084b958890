//! Stairs have no slope: the size of steps is searched for, and a gain that makes up for a wrong size does not hide the
//! right one.

use mops_core::{Input, case::Hold};
use mops_effects::effects;
use mops_math as math;

use crate::testing::{Record, integrated, study, subject, white};
use crate::{Options, diagnose};

const LAG: &str = r#"
states     = { x = "m" }
inputs     = { u = "m/s" }
parameters = { b = "1", a = "1/s" }
der        = { x = "x' = b*u - a*x" }
"#;
const STEP: f64 = 0.05;
const COUNT: usize = 400;
const NOISE: f64 = 2e-3;

fn command(t: f64) -> f64 {
    3.0 * math::sin(0.7 * t) + 1.1 * math::sin(2.3 * t + 1.0)
}

fn stairs(value: f64, size: f64) -> f64 {
    if size > 0.0 { size * (value / size).round() } else { value }
}

/// Returns the first effect found, its strength and the error that remains, for input and measurement in steps of
/// these sizes.
fn found(input: f64, measurement: f64) -> (String, f64, f64) {
    let fixed = |t: f64| command((t / STEP).floor() * STEP);
    let rates = |t: f64, x: &[f64; 1]| [1.3 * stairs(fixed(t), input) - 0.9 * x[0]];
    let states = integrated(rates, [0.5], STEP, COUNT);
    let times: Vec<f64> = (0..COUNT).map(|k| k as f64 * STEP).collect();
    let noise = white("steps", NOISE, COUNT);
    let values = states.iter().zip(noise).map(|(s, e)| stairs(s[0], measurement) + e).collect();
    let samples = times.iter().map(|&t| command(t)).collect();
    let inputs = vec![("u", Input::Sampled { times: times.clone(), values: samples, hold: Hold::Zero })];
    let record = Record { inputs, times, signals: vec![("x", values, NOISE)] };
    let subject = subject(LAG, &[1.2, 1.0, 0.5], 1, vec![record]);
    let options = Options { max_effects: 1, level: 0.01, ..Options::default() };
    let found = diagnose(&study(&subject), &effects(), &options, &()).expect("it simulates");
    let effect = &found.found[0];
    (effect.effect.clone(), effect.strengths[0].value, found.after[0].normalised)
}

#[test]
fn an_input_in_steps_is_found_with_the_size_of_its_steps() {
    let (name, size, left) = found(0.83, 0.0);
    assert_eq!(name, "input-quantisation");
    assert!((size - 0.83).abs() < 1e-3 && left < 1.1, "{size} {left}");
}

#[test]
fn fine_steps_of_a_measurement_are_found_with_their_size() {
    let (name, size, left) = found(0.0, 0.031);
    assert_eq!(name, "sensor-quantisation");
    assert!((size - 0.031).abs() < 1e-4 && left < 1.1, "{size} {left}");
}

#[test]
fn a_measurement_in_steps_is_found_with_the_size_of_its_steps() {
    let (name, size, left) = found(0.0, 0.37);
    assert_eq!(name, "sensor-quantisation");
    assert!((size - 0.37).abs() < 1e-3 && left < 1.1, "{size} {left}");
}
