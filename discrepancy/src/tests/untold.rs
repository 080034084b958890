//! Strengths that the data tell nothing of.

use crate::testing::{Record, catalogue, integrated, study, subject};
use crate::{Diagnosis, Found, Options, diagnose};

/// A pendulum: `w' = -g sin(th) - b w`.
const PENDULUM: &str = r#"
states     = { th = "rad", w = "rad/s" }
parameters = { g = "1/s^2", b = "1/s" }
der        = { th = "w", w = "w' = -g*sin(th) - b*w" }
"#;
const NOISE: f64 = 0.002;
const FRICTION: f64 = 0.8;

/// The pendulum let go at an angle, with dry friction of the same size at rest as in motion, for so many samples.
fn let_go(samples: usize) -> Diagnosis {
    let rates = |_: f64, x: &[f64; 2]| [x[1], -17.7 * x[0].sin() - 0.15 * x[1] - FRICTION * (x[1] / 1e-3).tanh()];
    let record = Record::of_first("th", &integrated(rates, [0.8, 0.0], 0.01, samples), 0.01, NOISE, "let go");
    let subject = subject(PENDULUM, &[23.3, 0.24, -1.0, 0.0], 2, vec![record]);
    let some = catalogue(&["coulomb-friction", "stiction", "stribeck-friction"]);
    let options = Options { max_effects: 2, level: 0.01, seed: 1 };
    diagnose(&study(&subject), &some, &options, &()).expect("it simulates")
}

/// What is found, and what the data are said not to tell from it.
fn first_of(told: &Diagnosis) -> (&Found, Vec<&str>) {
    let found = &told.found[0];
    (found, found.indistinguishable.iter().map(|r| r.effect.as_str()).collect())
}

#[test]
fn a_break_away_that_the_data_tell_nothing_of_is_as_likely_as_before_and_a_fall_that_they_rule_out_is_not() {
    // Until it rests, and a while longer.
    let told = let_go(742);
    let (found, rivals) = first_of(&told);
    assert_eq!(found.effect, "coulomb-friction");
    assert_eq!(rivals, ["stiction"], "{:?}", told.ranked);
    assert!(found.probability < 0.9 && found.indistinguishable[0].bic_behind < 3.0, "{found:?}");
}

#[test]
fn where_the_motion_never_ends_a_break_away_is_as_likely_as_before() {
    let told = let_go(250);
    let (found, rivals) = first_of(&told);
    assert_eq!(found.effect, "coulomb-friction");
    assert!(rivals.contains(&"stiction") && found.probability < 0.9, "{:?}", told.ranked);
}
