//! Greed: one effect at a time takes a wrong sign where only two together are physical.

use std::sync::Arc;

use mops_core::{Effect, Role, Study};
use mops_math as math;

use crate::testing::{Parts, Record, catalogue, integrated, subject};
use crate::{Options, diagnose};
use mops_outcome::diagnosis::Diagnosis;

/// A pendulum that is declared with viscous friction, and has dry friction and the air instead.
const PENDULUM: &str = r#"
states     = { q = "rad", w = "rad/s" }
parameters = { k = "1/s2", b = "1/s" }
der        = { q = "w", w = "w' = -k*sin(q) - b*w" }
"#;
const K: f64 = 60.0;
const DRY: f64 = 0.25;
const AIR: f64 = 0.03;
const NOISE: f64 = 5e-4;

fn swing(label: &str, start: f64) -> Record {
    const STEP: f64 = 0.02;
    const COUNT: usize = 400;
    // The motion ends before the friction holds the pendulum for good.
    let rates = |_: f64, x: &[f64; 2]| [x[1], -K * math::sin(x[0]) - DRY * x[1].signum() - AIR * x[1] * x[1].abs()];
    let states = integrated(rates, [start, 0.0], STEP, COUNT);
    Record::of_first("q", &states, STEP, NOISE, label)
}

fn diagnosis(effects: &[Arc<dyn Effect>], max_effects: usize) -> Diagnosis {
    diagnose(&swings(), effects, &Options { max_effects, level: 0.01, ..Options::default() }, &())
        .expect("it simulates")
}

/// Three swings of it.
pub fn swings() -> Study {
    let records = vec![swing("wide", 2.4), swing("middle", 1.6), swing("other", 2.0)];
    let mut subject = subject(PENDULUM, &[62.0, 0.05, 2.0, 0.0], 2, records);
    subject.measurements[2].role = Role::Selection;
    for (measurement, start) in subject.measurements.iter_mut().zip([2.4, 1.6, 2.0]) {
        measurement.locals[0].start = start;
    }
    let mut parts = Parts::of(&subject);
    // Friction takes energy: the coefficient is not negative.
    parts.tuners[1].bounds = [0.0, 1.0];
    parts.study(&subject)
}

#[test]
#[ignore = "full tier"]
fn dry_friction_and_quadratic_drag_are_found_together_and_no_coefficient_is_negative() {
    let all = catalogue(&["coulomb-friction", "quadratic-drag", "viscous-friction", "sensor-bias", "sensor-gain"]);
    let found = diagnosis(&all, 3);
    let mut names: Vec<&str> = found.found.iter().map(|f| f.effect.as_str()).collect();
    names.sort_unstable();
    assert_eq!(names, ["coulomb-friction", "quadratic-drag"], "{:?}", found.found);
    for (effect, truth) in [("coulomb-friction", DRY), ("quadratic-drag", AIR)] {
        let strength = &found.found.iter().find(|f| f.effect == effect).expect("it was found").strengths[0];
        assert!((strength.value - truth).abs() < 0.05 * truth, "{strength:?}");
    }
    // What was declared is the wrong term, and goes.
    let viscous = found.parameters.iter().find(|p| p.name == "b").expect("it is a tuner");
    assert!(viscous.after >= 0.0 && viscous.after < 0.01 * viscous.before.max(0.05), "{viscous:?}");
    assert_eq!((found.removed[0].term.as_str(), found.removed[0].place.as_str()), ("b", "joint:q"));
    assert!(found.after.iter().all(|e| e.normalised < 1.1), "{:?}", found.after);
}
