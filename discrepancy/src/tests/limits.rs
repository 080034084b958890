//! What the data want more of than an effect can be is not what they lack.

use crate::base;
use crate::judge::within_limits;
use crate::meter::Meter;
use crate::search::{Limits, Search, Trial};
use crate::subject::Subject;
use crate::testing::{Record, catalogue, integrated, study, subject};
use crate::{Diagnosis, Options, Verdict, diagnose};

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
    diagnose(&study(&lossy(k)), &catalogue(names), &Options { max_effects: 2, level: 0.01, seed: 1 }, &())
        .expect("it simulates")
}

#[test]
fn a_gain_that_may_be_is_told() {
    let told = found(0.4, &["sensor-gain"]);
    assert_eq!(told.verdict, Verdict::Effect, "{told:?}");
    let gain = &told.found[0].strengths[0];
    assert!((gain.value - 0.25).abs() < 0.02, "{gain:?}");
}

#[test]
fn a_gain_that_cannot_be_is_not_told() {
    let untold = found(0.2, &["sensor-gain"]);
    assert_eq!(untold.verdict, Verdict::Unexplained);
    assert!(untold.found.is_empty() && untold.ranked.is_empty(), "{:?} {:?}", untold.found, untold.ranked);
}

#[test]
fn an_effect_at_its_limit_is_left_out_although_it_fits_better() {
    let subject = lossy(0.2);
    let simulations = Meter::new(&());
    let some = catalogue(&["sensor-gain", "sensor-bias"]);
    let search = Search::new(&subject, &some, Limits::at(0.01), &simulations);
    let calibrated = base::fit(&subject, 1, &simulations).expect("it simulates");
    let declared = search.declared(&calibrated).expect("it simulates");
    let round = search.round(&declared).expect("it simulates");
    let names = |trial: &Trial<'_>| -> Vec<&str> { trial.added.iter().map(|a| a.candidate.effect.name()).collect() };
    assert_eq!(round.trials.iter().map(names).collect::<Vec<_>>(), [["sensor-bias"]]);
    let with_bias = &round.trials[0];
    let mut both = with_bias.added.clone();
    let gain =
        round.screened.iter().find(|s| s.added.candidate.effect.name() == "sensor-gain").expect("it was screened");
    both.insert(0, gain.added.clone());
    let both = search.from(with_bias, &both, 40).expect("it simulates");
    assert!(both.added[0].is_at_limit() && !both.is_physical(), "{:?}", both.added[0].strengths);
    assert!(both.fitted.chi2 < with_bias.fitted.chi2, "although it fits better");
    assert_eq!(search.pruned(&both, 0.01).as_ref().map(names), Some(vec!["sensor-bias"]));
    let alone = search.from(&both, &both.added[..1], 40).expect("it simulates");
    assert!(!alone.is_physical());
    assert_eq!(search.pruned(&alone, 0.01).as_ref().map(names), Some(vec![]));
    let after = search.calibrate(&both, &[]).expect("it simulates");
    let (within, _) = within_limits(&search, &both, &after).expect("one is at its limit");
    assert_eq!(names(&within), ["sensor-bias"]);
}
