//! Inputs that act earlier than their time stamps, or move between their samples, are no effects.

use mops_core::{Input, Role, case::Hold};
use mops_outcome::diagnosis::Alignment;

use crate::testing::{Record, catalogue, integrated, study, subject, white};
use crate::{Options, diagnose};
use mops_outcome::diagnosis::{Diagnosis, Verdict};

const TANK: &str = r#"
states     = { h = "cm", s = "cm" }
inputs     = { u = "V" }
parameters = { k = "cm/(V*s)", a = "1/s", b = "1/s" }
der        = { h = "k*u - a*h", s = "b*(h - s)" }
"#;
const STEP: f64 = 1.0;
const COUNT: usize = 200;
const NOISE: f64 = 0.01;

/// Steps of random height every third sample.
fn steps(record: usize) -> Vec<f64> {
    let heights = white(&format!("steps {record}"), 1.0, COUNT);
    (0..COUNT).map(|k| 3.0 + heights[k / 3]).collect()
}

/// Diagnosis of two records of a tank whose inflow is `inflow(samples, t)`, with a further outflow.
fn diagnosed(inflow: fn(&[f64], f64) -> f64, outflow: fn(f64) -> f64) -> Diagnosis {
    let record = |number: usize| {
        let values = steps(number);
        let rates =
            |t: f64, x: &[f64; 2]| [0.4 * inflow(&values, t / STEP) - 0.25 * x[0] - outflow(x[0]), 0.7 * (x[0] - x[1])];
        let states = integrated(rates, [4.0, 4.0], STEP, COUNT);
        let times: Vec<f64> = (0..COUNT).map(|k| k as f64 * STEP).collect();
        let noise = white(&format!("tank {number}"), NOISE, COUNT);
        let levels = states.iter().zip(noise).map(|(x, e)| x[1] + e).collect();
        let input = Input::Sampled { times: times.clone(), values, hold: Hold::Zero };
        Record { inputs: vec![("u", input)], times, signals: vec![("s", levels, NOISE)] }
    };
    let mut subject = subject(TANK, &[0.4, 0.25, 0.7, 4.0, 4.0], 2, (0..2).map(record).collect());
    subject.measurements[1].role = Role::Selection;
    let effects = catalogue(&[
        "leak",
        "sensor-lag",
        "actuator-lag",
        "input-delay",
        "orifice-exponent",
        "sensor-gain",
        "overflow",
    ]);
    diagnose(&study(&subject), &effects, &Options { max_effects: 2, level: 0.05, ..Options::default() }, &())
        .expect("it simulates")
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn at(values: &[f64], sample: f64) -> f64 {
    values[(sample.max(0.0) as usize).min(values.len() - 1)]
}

fn alignment(shift: f64, hold: Hold) -> Vec<Alignment> {
    vec![Alignment { input: "u".to_owned(), shift, hold }]
}

#[test]
fn an_input_that_is_logged_after_it_has_acted_is_aligned() {
    let found = diagnosed(|values, sample| at(values, sample.floor() + 1.0), |_| 0.0);
    assert_eq!(found.alignment, alignment(-STEP, Hold::Zero));
    assert!(found.found.is_empty() && found.verdict == Verdict::None, "{:?}", found.verdict);
    assert!(found.after[0].normalised < 1.1 && found.before[0].normalised > 3.0);
}

#[test]
fn an_input_that_moves_between_its_samples_is_interpolated() {
    let between = |values: &[f64], sample: f64| {
        let (from, to) = (at(values, sample.floor()), at(values, sample.floor() + 1.0));
        from + (sample - sample.floor()) * (to - from)
    };
    let found = diagnosed(between, |_| 0.0);
    assert_eq!(found.alignment, alignment(0.0, Hold::First));
    assert!(found.found.is_empty(), "{:?}", found.found);
}

#[test]
fn a_delay_and_a_leak_are_effects() {
    let late = diagnosed(|values, sample| at(values, (sample - 1.5).floor()), |_| 0.0);
    assert!(late.alignment.is_empty(), "{:?}", late.alignment);
    assert_eq!(late.found[0].effect, "input-delay");
    let leaking =
        diagnosed(|values, sample| at(values, sample.floor()), |h| if h > 4.5 { 0.5 * (h - 4.5).sqrt() } else { 0.0 });
    assert!(leaking.alignment.is_empty(), "{:?}", leaking.alignment);
    assert!(leaking.found.iter().any(|found| found.class == "flow"), "{:?}", leaking.found);
}
