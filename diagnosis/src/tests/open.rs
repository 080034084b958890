//! Parameters that the data do not determine.

use mops_core::{Input, case::Hold};
use mops_math as math;

use crate::testing::{Record, catalogue, integrated, study, subject};
use crate::{Options, diagnose};
use mops_outcome::diagnosis::{Diagnosis, Found};

/// A pendulum: `w' = -g sin(th) - b w`.
const PENDULUM: &str = r#"
states     = { th = "rad", w = "rad/s" }
parameters = { g = "1/s^2", b = "1/s" }
der        = { th = "w", w = "w' = -g*sin(th) - b*w" }
"#;
const NOISE: f64 = 0.002;
const FRICTION: f64 = 0.8;

/// The pendulum let go at an angle, with dry friction of the same size at rest as in motion, for so many samples with
/// this noise.
fn let_go(samples: usize, noise: &str) -> Diagnosis {
    let rates =
        |_: f64, x: &[f64; 2]| [x[1], -17.7 * math::sin(x[0]) - 0.15 * x[1] - FRICTION * math::tanh(x[1] / 1e-3)];
    let record = Record::of_first("th", &integrated(rates, [0.8, 0.0], 0.01, samples), 0.01, NOISE, noise);
    let subject = subject(PENDULUM, &[23.3, 0.24, -1.0, 0.0], 2, vec![record]);
    let some = catalogue(&["coulomb-friction", "stiction", "stribeck-friction"]);
    let options = Options { max_effects: 2, level: 0.01, ..Options::default() };
    diagnose(&study(&subject), &some, &options, &()).expect("it simulates")
}

/// A cart: `v' = k u - b v`.
const CART: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "V" }
parameters = { k = "m/(V s^2)", b = "1/s" }
der        = { x = "v", v = "v' = k*u - b*v" }
"#;

/// The cart with dry friction of the same size at rest as in motion, pushed back and forth from rest.
fn pushed() -> Diagnosis {
    let push = |t: f64| 2.0 * math::sin(0.9 * t);
    let rates = |t: f64, x: &[f64; 2]| [x[1], push(t) - 0.5 * x[1] - FRICTION * math::tanh(x[1] / 1e-3)];
    let mut record = Record::of_first("x", &integrated(rates, [0.0, 0.0], 0.02, 900), 0.02, NOISE, "pushed");
    let times: Vec<f64> = (0..9000_i32).map(|i| 0.002 * f64::from(i)).collect();
    let values = times.iter().map(|&t| push(t)).collect();
    record.inputs = vec![("u", Input::Sampled { times, values, hold: Hold::First })];
    let subject = subject(CART, &[0.8, 0.9, 0.0, 0.0], 2, vec![record]);
    let some = catalogue(&["coulomb-friction", "stiction"]);
    let options = Options { max_effects: 2, level: 0.01, ..Options::default() };
    diagnose(&study(&subject), &some, &options, &()).expect("it simulates")
}

/// Returns what is found, and what the data do not distinguish from it.
fn first_of(diagnosis: &Diagnosis) -> (&Found, Vec<&str>) {
    let found = &diagnosis.found[0];
    (found, found.indistinguishable.iter().map(|r| r.effect.as_str()).collect())
}

#[test]
fn a_break_away_that_the_data_do_not_show_is_as_likely_as_before_and_a_fall_that_they_rule_out_is_not() {
    // Until it rests, and a while longer.
    let all: Vec<Diagnosis> = (0..5).map(|k| let_go(742, &format!("let go {k}"))).collect();
    for diagnosis in &all {
        let (found, rivals) = first_of(diagnosis);
        assert_eq!(found.effect, "coulomb-friction", "{:?}", diagnosis.ranked);
        let stiction = rivals.iter().position(|rival| *rival == "stiction").expect("it is as likely as before");
        assert!(found.probability < 0.9 && found.indistinguishable[stiction].bic_behind < 3.0, "{found:?}");
    }
    // In some, noise looks like a small fall.
    let ruled_out = all.iter().filter(|diagnosis| first_of(diagnosis).1.len() == 1).count();
    assert!(ruled_out >= 3, "{ruled_out} of 5");
}

#[test]
fn where_the_motion_never_ends_a_break_away_is_as_likely_as_before() {
    let diagnosis = let_go(250, "let go");
    let (found, rivals) = first_of(&diagnosis);
    assert_eq!(found.effect, "coulomb-friction");
    assert!(rivals.contains(&"stiction") && found.probability < 0.9, "{:?}", diagnosis.ranked);
}

#[test]
#[ignore = "full tier"]
fn a_break_away_that_the_data_show_costs_the_whole() {
    // It breaks away at every reversal of the push.
    let diagnosis = pushed();
    let (found, rivals) = first_of(&diagnosis);
    assert_eq!(found.effect, "coulomb-friction");
    assert!(rivals.is_empty() && found.probability > 0.9, "{:?}", diagnosis.ranked);
}
