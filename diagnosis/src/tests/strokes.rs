//! One smooth stroke: a smooth error explains any residual, an effect nearly all of it.

use std::f64::consts::PI;

use mops_core::{Input, case::Hold};
use mops_effects::effects;
use mops_math as math;
use mops_outcome::diagnosis::{Diagnosis, NamedBy, Verdict};

use crate::testing::{Record, integrated, study, subject, white};
use crate::{Options, diagnose};

const SLED: &str = r#"
states     = { v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", b = "N*s/m" }
der        = { v = "m*v' = u - b*v" }
"#;

/// Force of a push of half a sine, N.
fn push(t: f64) -> f64 {
    if t < 0.4 { 140.0 * math::sin(PI * t / 0.4) } else { 0.0 }
}

/// The speed of a sled of 25 kg on a rail with dry friction (N), with a smooth error of the sensor (m/s).
fn pushed(friction: f64, error: f64) -> Record {
    const STEP: f64 = 0.004;
    let rates = |t: f64, x: &[f64; 1]| {
        let drive = push(t);
        let against = if x[0] > 0.0 { friction } else { friction.min(drive) };
        [(drive - 40.0 * x[0] - against) / 25.0]
    };
    let states = integrated(rates, [0.0], STEP, 150);
    let times: Vec<f64> = (0..150).map(|k| f64::from(k) * STEP).collect();
    let noise = white("sled", 4e-4, times.len());
    let wave = |t: f64| error * math::sin(2.0 * PI * t / 0.17);
    let values = states.iter().zip(&times).zip(noise).map(|((s, &t), e)| s[0] + wave(t) + e).collect();
    let samples = times.iter().map(|&t| push(t)).collect();
    let inputs = vec![("u", Input::Sampled { times: times.clone(), values: samples, hold: Hold::First })];
    Record { inputs, times, signals: vec![("v", values, 4e-4)] }
}

/// Diagnoses a push of a sled on a rail with dry friction of 20 N, with a smooth error of the sensor (m/s).
fn diagnosed(error: f64) -> Diagnosis {
    let subject = subject(SLED, &[20.0, 20.0, 0.0], 1, vec![pushed(20.0, error)]);
    let options = Options { max_effects: 1, ..Options::default() };
    let found = diagnose(&study(&subject), &effects(), &options, &()).expect("it simulates");
    assert!(found.before[0].normalised > 5.0 * found.after[0].normalised, "{:?} {:?}", found.before, found.after);
    let first = found.found.first().expect("friction is named");
    assert_eq!((first.effect.as_str(), first.place.as_str()), ("coulomb-friction", "speed:v"));
    found
}

#[test]
fn dry_friction_of_a_speed_without_a_position_is_claimed() {
    let found = diagnosed(2e-3);
    assert_eq!((found.verdict, found.named_by, found.found[0].claimed), (Verdict::Effect, NamedBy::Evidence, true));
}

#[test]
fn least_squares_alone_proposes_what_a_larger_smooth_error_hides_from_the_evidence() {
    let found = diagnosed(4e-3);
    assert_eq!((found.verdict, found.named_by), (Verdict::Unexplained, NamedBy::LeastSquares));
    assert!(!found.found[0].claimed && found.found[0].class_probability.is_nan());
}
