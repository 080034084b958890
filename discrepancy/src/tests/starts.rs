//! What a hidden state starts with is unknown, and no error of the model.

use mops_core::{Hold, Input};

use crate::base::first_locals;
use crate::meter::Meter;
use crate::search::{Limits, Search};
use crate::testing::{Record, catalogue, integrated, subject, white};

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

/// What the motor is told: steps that never settle.
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
    const PULL: f64 = 6.0;
    let record = pulled(PULL, "pull");
    let subject = subject(CART, &[M, D, 0.0, 0.0], 2, vec![record]);
    let simulations = Meter::new(&());
    let lag = catalogue(&["actuator-lag"]);
    let limits = Limits::at(0.01);
    let search = Search::new(&subject, &lag, limits, &simulations);
    let declared = search.trial(&[], &subject.start(), vec![vec![0.0; 2]], 1, 60).expect("it simulates");
    assert!(declared.fitted.normalised() > 5.0, "{}", declared.fitted.normalised());

    let round = search.round(&declared).expect("it simulates");
    let best = &round.trials[0];
    assert!(best.fitted.normalised() < 1.1, "{}", best.fitted.normalised());
    assert!((best.added[0].strengths[0] - TAU).abs() < 0.05 * TAU, "{:?}", best.added[0].strengths);
    // The lag begins with what the motor pulled beyond the command, `6 - (-2)`.
    let start = best.fitted.point.locals[0][2];
    assert!((start - (PULL - command(0.0))).abs() < 0.4, "{start}");
}

/// The same cart behind a motor whose pull `f` follows the command with a lag, as the model says.
const MOTOR: &str = r#"
states     = { f = "N", x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", d = "N s/m", tau = "s" }
der        = { f = "(u - f)/tau", x = "v", v = "m*v' = f - d*v" }
"#;

#[test]
fn a_state_that_nobody_measures_begins_anew_in_every_window() {
    let record = pulled(0.0, "motor");
    // Where the pull begins is known; where it is as a window begins is not.
    let subject = subject(MOTOR, &[M, D, TAU, 0.0, 0.0, 0.0], 2, vec![record]);
    let simulations = Meter::new(&());
    let search = Search::new(&subject, &[], Limits::at(0.01), &simulations);
    let locals = first_locals(&search.pieces(8));
    let windows = search.trial(&[], &subject.start(), locals, 8, 40).expect("it simulates");
    assert!(windows.fitted.normalised() < 1.1, "{}", windows.fitted.normalised());
}
