//! A bound that is too near looks like an effect that is missing.

use crate::testing::{Parts, Record, integrated, subject};
use crate::{Options, diagnose};

const DECAY: &str = r#"
states     = { x = "m" }
parameters = { a = "1/s" }
der        = { x = "-a*x" }
"#;

#[test]
fn a_declared_parameter_that_its_bound_stops_is_reported() {
    let states = integrated(|_, x: &[f64; 2]| [-0.5 * x[0], 0.0], [2.0, 0.0], 0.05, 100);
    let subject = subject(DECAY, &[0.35, 2.0], 1, vec![Record::of_first("x", &states, 0.05, 0.01, "decay")]);
    let notes = |largest: f64| {
        let mut parts = Parts::of(&subject);
        parts.tuners[0].bounds = [0.1, largest];
        let study = parts.study(&subject);
        diagnose(&study, &[], &Options { max_effects: 1, level: 0.01, ..Options::default() }, &())
            .expect("it simulates")
            .notes
    };
    assert!(notes(1.0).iter().all(|note| !note.contains("bound")));
    let found = notes(0.4);
    assert!(
        found.iter().any(|n| n.starts_with("`a` of the declared and of the repaired model is at its upper bound 0.4")),
        "{found:?}"
    );
}
