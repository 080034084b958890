//! What the data want more of than an effect can be is not what they lack.

use crate::records::Subject;
use crate::testing::{Record, catalogue, integrated, study, subject};
use crate::{Options, diagnose};
use mops_outcome::diagnosis::{Diagnosis, Verdict};

const LOSS: &str = r#"
states     = { x = "m" }
parameters = { a = "1/s" }
der        = { x = "-a*x - 0.5 [1/m/s]*x*abs(x)" }
"#;

/// What loses `k x |x|` looks, where 0.5 is declared, as if its sensor showed `0.5 / k` times what it measures.
fn lossy(k: f64) -> Subject {
    let states = integrated(|_, x: &[f64; 2]| [-0.3 * x[0] - k * x[0] * x[0].abs(), 0.0], [2.0, 0.0], 0.05, 200);
    subject(LOSS, &[0.25, 1.8], 1, vec![Record::of_first("x", &states, 0.05, 1e-3, "loss")])
}

fn found(k: f64, names: &[&str]) -> Diagnosis {
    diagnose(&study(&lossy(k)), &catalogue(names), &Options { max_effects: 2, level: 0.01, ..Options::default() }, &())
        .expect("it simulates")
}

#[test]
fn a_gain_that_may_be_is_found() {
    let made = found(0.4, &["sensor-gain"]);
    assert_eq!(made.verdict, Verdict::Effect, "{made:?}");
    let gain = &made.found[0].strengths[0];
    assert!((gain.value - 0.25).abs() < 0.02, "{gain:?}");
}

#[test]
fn a_gain_that_cannot_be_is_not_found() {
    let made = found(0.2, &["sensor-gain"]);
    assert_eq!(made.verdict, Verdict::Unexplained);
    assert!(made.found.is_empty(), "{:?}", made.found);
}
