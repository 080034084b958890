//! Residuals next to each other that are alike are not worth as much as many of their own.

use mops_effects::effects;
use mops_math as math;

use crate::records::Subject;
use crate::testing::{Record, catalogue, integrated, study, subject, white};
use crate::{Options, diagnose};
use mops_outcome::diagnosis::Verdict;

const CREEP: &str = r#"
states     = { x = "m" }
parameters = { k = "1/s" }
der        = { x = "-k*x" }
"#;

/// A pendulum: `w' = -g sin(th) - b w`.
const PENDULUM: &str = r#"
states     = { th = "rad", w = "rad/s" }
parameters = { g = "1/s^2", b = "1/s" }
der        = { th = "w", w = "w' = -g*sin(th) - b*w" }
"#;

/// Errors with the correlation `r` from one to the next, and variance 1.
fn errors(r: f64, label: &str, count: usize) -> Vec<f64> {
    let mut error = 0.0;
    let follow = |e: f64| {
        error = r * error + (1.0 - r * r).sqrt() * e;
        error
    };
    white(label, 1.0, count).into_iter().map(follow).collect()
}

/// A decay whose errors have the correlation `r` from sample to sample, and variance 1.
fn decay(r: f64, label: &str) -> Subject {
    let times: Vec<f64> = (0..4000_u32).map(|k| 0.005 * f64::from(k)).collect();
    let errors = errors(r, label, times.len());
    let values = times.iter().zip(errors).map(|(t, e)| 50.0 * math::exp(-0.3 * t) + e).collect();
    subject(CREEP, &[0.3, 50.0], 1, vec![Record { inputs: Vec::new(), times, signals: vec![("x", values, 1.0)] }])
}

#[test]
#[ignore = "full tier"]
fn noise_that_is_correlated_is_not_taken_for_an_effect() {
    for label in ["alike 1", "alike 2", "alike 3"] {
        let study = study(&decay(0.9, label));
        let diagnosis =
            diagnose(&study, &effects(), &Options { max_effects: 2, level: 0.05, ..Options::default() }, &());
        let diagnosis = diagnosis.expect("it simulates");
        let names: Vec<_> = diagnosis.found.iter().map(|f| (&f.effect, &f.place)).collect();
        assert_eq!(diagnosis.verdict, Verdict::None, "{label}: {names:?}");
    }
}

#[test]
#[ignore = "full tier"]
fn where_noise_is_correlated_the_simpler_of_two_effects_is_found() {
    const STEP: f64 = 0.01;
    const NOISE: f64 = 0.01;
    let rates = |_: f64, x: &[f64; 2]| [x[1], -17.7 * math::sin(x[0]) - 0.15 * x[1] - 0.8 * math::tanh(x[1] / 1e-3)];
    let some = catalogue(&["coulomb-friction", "asymmetric-friction", "stribeck-friction"]);
    for label in ["one", "two", "three", "four"] {
        let states = integrated(rates, [1.2, 0.0], STEP, 600);
        let times = (0..600_u32).map(|k| STEP * f64::from(k)).collect();
        let values = states.iter().zip(errors(0.95, label, 600)).map(|(x, e)| x[0] + NOISE * e).collect();
        let record = Record { inputs: Vec::new(), times, signals: vec![("th", values, NOISE)] };
        let subject = subject(PENDULUM, &[17.0, 0.2, 1.2, 0.0], 2, vec![record]);
        let options = Options { max_effects: 1, level: 0.01, ..Options::default() };
        let diagnosis = diagnose(&study(&subject), &some, &options, &()).expect("it simulates");
        let names: Vec<_> = diagnosis.found.iter().map(|f| f.effect.as_str()).collect();
        assert_eq!(names, ["coulomb-friction"], "{label}");
        // Of effects within one nat, two in the BIC, the simplest is named.
        assert!(diagnosis.found[0].indistinguishable.iter().all(|rival| rival.bic_behind > -2.0), "{label}");
    }
}
