//! What a hidden state starts with is unknown, and no error of the model.

use mops_core::{Input, case::Hold};

use crate::testing::{Record, catalogue, integrated, study, subject, white};
use crate::{Options, diagnose};

const CART: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", d = "N s/m" }
der        = { x = "v", v = "m*v' = u - d*v" }
"#;

/// Mass, damping and time constant of the lag.
const M: f64 = 2.0;
const D: f64 = 0.8;
const TAU: f64 = 0.4;

/// Command of the motor: steps that never settle.
fn command(t: f64) -> f64 {
    if (t / 1.1 + 1e-7).floor() % 2.0 < 1.0 { -2.0 } else { 3.0 }
}

/// The position of the cart behind a motor whose pull begins with this and follows the command with a lag.
fn pulled(pull: f64, label: &str) -> Record {
    const STEP: f64 = 0.02;
    const COUNT: u32 = 250;
    let rates = |t: f64, x: &[f64; 3]| [x[1], (x[2] - D * x[1]) / M, (command(t) - x[2]) / TAU];
    let states = integrated(rates, [0.0, 0.0, pull], STEP, COUNT as usize);
    let times: Vec<f64> = (0..COUNT).map(|k| f64::from(k) * STEP).collect();
    let values = states.iter().zip(white(label, 2e-3, states.len())).map(|(s, e)| s[0] + e).collect();
    let samples = times.iter().map(|&t| command(t)).collect();
    let inputs = vec![("u", Input::Sampled { times: times.clone(), values: samples, hold: Hold::Zero })];
    Record { inputs, times, signals: vec![("x", values, 2e-3)] }
}

#[test]
fn a_motor_with_a_lag_that_pulls_before_the_record_begins_leaves_only_the_noise() {
    const PULL: f64 = 4.0;
    let subject = subject(CART, &[M, D, 0.0, 0.0], 2, vec![pulled(PULL, "pull")]);
    let options = Options { max_effects: 1, level: 0.01, ..Options::default() };
    let found = diagnose(&study(&subject), &catalogue(&["actuator-lag"]), &options, &()).expect("it simulates");
    assert!(found.before[0].normalised > 5.0, "{:?}", found.before);
    assert!(found.after[0].normalised < 1.1, "{:?}", found.after);
    assert!((found.found[0].strengths[0].value - TAU).abs() < 0.05 * TAU, "{:?}", found.found[0].strengths);
    // The lag begins with what the motor pulled beyond the command, `4 - (-2)`.
    let start = found.starts.iter().find(|(_, name, _)| name == "u-actuator-lag.start1").expect("the lag has a state");
    assert!((start.2 - (PULL - command(0.0))).abs() < 0.4, "{start:?}");
}
