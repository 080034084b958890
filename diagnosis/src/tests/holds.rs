//! The wrong hold of an input hides an effect: what the command did between its samples looks like a force of its own.

use mops_core::{Input, case::Hold};
use mops_effects::effects;
use mops_math as math;

use crate::fit::Meter;
use crate::testing::{Record, fitted, integrated, screened, subject, white};

const OSCILLATOR: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", k = "N/m", d = "N s/m" }
der        = { x = "v", v = "m*v' = u - k*x - d*v" }
"#;
const STEP: f64 = 0.1;
const COUNT: usize = 400;
/// Steps of the truth in each step of the record.
const FINE: usize = 20;
const NOISE: f64 = 1e-4;

/// Up to half of the highest frequency that the samples can show.
fn command(t: f64) -> f64 {
    let sines = (1..=25).map(|k| f64::from(k) * std::f64::consts::PI * 0.5 / (25.0 * STEP));
    sines.enumerate().map(|(i, w)| 2.0 * math::sin(w * t + (i * i) as f64)).sum()
}

/// Positions of an oscillator with a spring that stiffens, driven by a command without steps.
fn record(hold: Hold) -> Record {
    let rates =
        |t: f64, x: &[f64; 2]| [x[1], (command(t) - 30.0 * x[0] - 0.6 * x[1] - 3.0 * math::powi(x[0], 3)) / 1.2];
    let states = integrated(rates, [0.0, 0.0], STEP / FINE as f64, COUNT * FINE);
    let times: Vec<f64> = (0..COUNT).map(|k| k as f64 * STEP).collect();
    let noise = white("hold", NOISE, COUNT);
    let values = states.iter().step_by(FINE).zip(noise).map(|(s, e)| s[0] + e).collect();
    let samples = times.iter().map(|&t| command(t)).collect();
    Record {
        inputs: vec![("u", Input::Sampled { times: times.clone(), values: samples, hold })],
        times,
        signals: vec![("x", values, NOISE)],
    }
}

/// Share of what the declared model leaves that the missing effect explains.
fn explained(hold: Hold) -> f64 {
    let subject = subject(OSCILLATOR, &[1.2, 30.0, 0.6, 0.0, 0.0], 2, vec![record(hold)]);
    let simulations = Meter::new(&());
    let (fit, _, point, _) = fitted(&subject, &simulations);
    let left: f64 = fit.all(&point).expect("it simulates").iter().flatten().map(|r| r * r).sum();
    let screened = screened(&subject, &effects(), &simulations);
    let cubic = screened.iter().find(|(name, _)| name == "cubic-stiffness");
    2.0 * cubic.expect("a position can have a spring").1 / left
}

#[test]
fn the_wrong_input_hold_hides_the_effect() {
    let (zero, band_limited) = (explained(Hold::Zero), explained(Hold::BandLimited));
    assert!(band_limited > 0.9 && zero < 0.5, "{band_limited}, {zero}");
}
