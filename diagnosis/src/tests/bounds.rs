//! A bound that is too near looks like an effect that is missing.

use mops_effects::effects;
use mops_outcome::diagnosis::{Diagnosis, Verdict};

use crate::testing::{Parts, Record, integrated, subject};
use crate::{Options, diagnose};

const DECAY: &str = r#"
states     = { x = "m" }
parameters = { a = "1/s" }
der        = { x = "-a*x" }
"#;

/// A mass on a spring with a damper, pulled and let go.
const SWING: &str = r#"
states     = { x = "m", v = "m/s" }
parameters = { k = "1/s^2", d = "1/s" }
der        = { x = "v", v = "-k*x - d*v" }
"#;

/// Diagnoses a swing that is damped by twice as much as its range allows, with all effects of a joint.
fn swung(range: [f64; 2]) -> Diagnosis {
    const K: f64 = 9.0;
    const D: f64 = 0.8;
    let states = integrated(|_, x: &[f64; 2]| [x[1], -K * x[0] - D * x[1]], [1.0, 0.0], 0.05, 150);
    let record = Record::of_first("x", &states, 0.05, 2e-3, "swing");
    let subject = subject(SWING, &[8.0, 0.3, 1.0, 0.0], 2, vec![record]);
    let mut parts = Parts::of(&subject);
    parts.tuners[1].bounds = range;
    let study = parts.study(&subject);
    diagnose(&study, &effects(), &Options { max_effects: 1, ..Options::default() }, &()).expect("it simulates")
}

#[test]
fn a_range_that_ends_too_early_is_widened_before_an_effect_is_looked_for() {
    let found = swung([0.0, 0.4]);
    let wider = found.wider.as_ref().expect("the damping leaves its range");
    assert_eq!((found.verdict, found.found.len(), wider.ranges.len()), (Verdict::Unexplained, 0, 1));
    let range = &wider.ranges[0];
    assert_eq!((range.parameter.as_str(), range.end), ("d", 0.4));
    assert!((range.value - 0.8).abs() < 0.02 && wider.error < 1.1, "{wider:?}");
    let simulations = swung([0.0, 4.0]).simulations;
    assert!(found.simulations < 2 * simulations, "no effect was fitted: {} and {simulations}", found.simulations);
}

#[test]
fn a_range_narrower_than_a_factor_of_two_is_knowledge() {
    let found = swung([0.25, 0.4]);
    assert!(found.wider.is_none());
    let first = found.found.first().expect("a friction takes the place of the damping that the range excludes");
    assert_eq!(first.class, "dissipative");
}

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
