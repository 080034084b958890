//! Strengths that the data tell nothing of.

use crate::testing::{Record, catalogue, integrated, study, subject};
use crate::{Options, diagnose};

/// A pendulum: `w' = -g sin(th) - b w`.
const PENDULUM: &str = r#"
states     = { th = "rad", w = "rad/s" }
parameters = { g = "1/s^2", b = "1/s" }
der        = { th = "w", w = "w' = -g*sin(th) - b*w" }
"#;
const NOISE: f64 = 0.002;
const FRICTION: f64 = 0.8;

#[test]
fn a_break_away_that_the_data_tell_nothing_of_is_as_likely_as_before_and_a_fall_that_they_rule_out_is_not() {
    // Let go at an angle, until it rests and a while longer.
    let rates = |_: f64, x: &[f64; 2]| [x[1], -17.7 * x[0].sin() - 0.15 * x[1] - FRICTION * (x[1] / 1e-3).tanh()];
    let record = Record::of_first("th", &integrated(rates, [0.8, 0.0], 0.01, 742), 0.01, NOISE, "let go");
    let subject = subject(PENDULUM, &[23.3, 0.24, -1.0, 0.0], 2, vec![record]);
    let some = catalogue(&["coulomb-friction", "stiction", "stribeck-friction"]);
    let options = Options { max_effects: 2, level: 0.01, seed: 1 };
    let told = diagnose(&study(&subject), &some, &options, &()).expect("it simulates");
    let found = &told.found[0];
    assert_eq!(found.effect, "coulomb-friction");
    let rivals: Vec<&str> = found.indistinguishable.iter().map(|r| r.effect.as_str()).collect();
    assert_eq!(rivals, ["stiction"], "{:?}", told.ranked);
    assert!(found.probability < 0.9 && found.indistinguishable[0].bic_behind < 3.0, "{found:?}");
}
