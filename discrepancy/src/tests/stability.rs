//! A choice that rests on noise, or on one experiment alone, is told from one that rests on all data.

use crate::meter::Meter;
use crate::search::{Limits, Search};
use mops_core::diagnosis::Stability;

use crate::stability::stability;
use crate::testing::{Record, catalogue, integrated, subject};

const OSCILLATOR: &str = r#"
states     = { x = "m", v = "m/s" }
parameters = { k = "1/s2", d = "1/s" }
der        = { x = "v", v = "v' = -k*x - d*v" }
"#;
const NOISE: f64 = 1e-3;
const BOTH: &[&str] = &["coulomb-friction", "quadratic-stiffness"];

/// A free oscillation with dry friction and a spring that is stiffer to one side.
fn record(label: &str, dry: f64, bent: f64) -> Record {
    const STEP: f64 = 0.02;
    const COUNT: usize = 300;
    let force = |x: &[f64; 2]| -20.0 * x[0] - bent * x[0] * x[0] - 0.2 * x[1] - dry * x[1].signum();
    let rates = |_: f64, x: &[f64; 2]| [x[1], force(x)];
    let states = integrated(rates, [1.0, 0.0], STEP, COUNT);
    Record::of_first("x", &states, STEP, NOISE, label)
}

/// The best effect of a first round, and its stability.
fn chosen(named: &[&str], records: Vec<Record>) -> (String, Stability) {
    let count = records.len();
    let subject = subject(OSCILLATOR, &[20.0, 0.2, 1.0, 0.0], 2, records);
    let simulations = Meter::new(&());
    let some = catalogue(named);
    let limits = Limits::at(0.01);
    let search = Search::new(&subject, &some, limits, &simulations);
    let declared = search.trial(&[], &subject.start(), vec![vec![1.0, 0.0]; count], 1, 60).expect("it simulates");
    let round = search.round(&declared).expect("it simulates");
    let best = round.trials[0].added[0].candidate.effect.name().to_owned();
    (best, stability(&round, 0).expect("there are rivals"))
}

#[test]
fn an_effect_in_all_experiments_is_chosen_whatever_is_drawn() {
    let (best, stability) = chosen(BOTH, vec![record("one", 0.1, 0.0), record("two", 0.1, 0.0)]);
    assert_eq!(best, "coulomb-friction");
    assert!(stability.share > 0.99 && stability.hangs_on.is_empty(), "{stability:?}");
}

#[test]
fn an_effect_of_one_experiment_hangs_on_that() {
    let (best, stability) = chosen(BOTH, vec![record("one", 0.06, 0.0), record("two", 0.0, 0.04)]);
    assert_eq!(best, "coulomb-friction");
    let hangs: Vec<&str> = stability.hangs_on.iter().map(|h| h.effect.as_str()).collect();
    assert_eq!(hangs, ["quadratic-stiffness"], "{stability:?}");
}

#[test]
fn what_is_chosen_by_chance_is_not_chosen_again() {
    let either_way = &["quadratic-stiffness", "sensor-drift"];
    let (_, stability) = chosen(either_way, vec![record("one", 0.0, 0.0), record("two", 0.0, 0.0)]);
    assert!(stability.share < 0.95, "{stability:?}");
    let share = |noise: &str| chosen(&["sensor-drift", "damping-drift"], vec![record(noise, 0.0, 0.0)]).1.share;
    let shares = ["one", "two", "three", "four", "five"].map(share);
    assert!(shares.iter().sum::<f64>() < 0.9 * 5.0, "{shares:?}");
}
