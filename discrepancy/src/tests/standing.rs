//! What is said of an effect beside its rivals, wherever the search ended.

use std::sync::Arc;

use mops_core::math;
use mops_core::{Hold, Input};

use crate::base;
use crate::meter::Meter;
use crate::round::Round;
use crate::search::{Limits, Search};
use crate::standing::Standing;
use crate::testing::{Record, catalogue, integrated, subject};
use crate::weigh::{Dispersion, criterion};

/// A pendulum: `w' = -g sin(th) - b w`.
const PENDULUM: &str = r#"
states     = { th = "rad", w = "rad/s" }
parameters = { g = "1/s^2", b = "1/s" }
der        = { th = "w", w = "w' = -g*sin(th) - b*w" }
"#;
const NOISE: f64 = 0.01;

fn swing() -> Record {
    let rates = |_: f64, x: &[f64; 2]| [x[1], -17.7 * math::sin(x[0]) - 0.15 * x[1] - 0.5 * math::tanh(x[1] / 1e-3)];
    Record::of_first("th", &integrated(rates, [0.9, 0.0], 0.01, 400), 0.01, NOISE, "swing")
}

#[test]
fn a_likelier_rival_of_what_was_chosen_is_told_first() {
    let subject = subject(PENDULUM, &[17.0, 0.2, 0.9, 0.0], 2, vec![swing()]);
    let simulations = Meter::new(&());
    let some = catalogue(&["coulomb-friction", "asymmetric-friction", "linear-stiffness"]);
    let search = Search::new(&subject, &some, Limits::at(0.01), &simulations);
    let declared = search.declared(&base::fit(&subject, 1, &simulations).expect("it simulates")).expect("it simulates");
    let rounds = [search.round(&declared).expect("it simulates")];
    let names: Vec<_> = rounds[0].trials.iter().map(|t| t.added[0].candidate.effect.name()).collect();
    assert_eq!(names[..2], ["coulomb-friction", "asymmetric-friction"]);

    let first = Standing::of(&search, &rounds, &rounds[0].trials[0], 0).expect("it was tried");
    let second = Standing::of(&search, &rounds, &rounds[0].trials[1], 0).expect("it was tried");
    assert!(
        first.probability() > 0.5 && second.probability() < 0.5,
        "{} {}",
        first.probability(),
        second.probability()
    );
    assert!((first.probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    let (behind, ahead) = (first.rivals(), second.rivals());
    assert!(behind.iter().all(|rival| rival.bic_behind > 0.0), "{behind:?}");
    assert!(ahead[0].effect == "coulomb-friction" && ahead[0].bic_behind < 0.0, "{ahead:?}");
}

#[test]
fn rivals_that_are_far_off_to_first_order_are_not_fitted_again() {
    let subject = subject(PENDULUM, &[17.0, 0.2, 0.9, 0.0], 2, vec![swing()]);
    let simulations = Meter::new(&());
    let some = catalogue(&["coulomb-friction", "asymmetric-friction", "sensor-bias", "constant-force"]);
    let search = || Search::new(&subject, &some, Limits::at(0.01), &simulations);
    let searched = search();
    let declared = searched.declared(&base::fit(&subject, 1, &simulations).expect("it simulates"));
    let declared = declared.expect("it simulates");
    let round = searched.round(&declared).expect("it simulates");
    let names =
        |round: &Round<'_>| -> Vec<&str> { round.trials.iter().map(|t| t.added[0].candidate.effect.name()).collect() };
    assert_eq!(round.trials.len(), 4, "{:?}", names(&round));
    let known = searched.round_against(&declared, &round.trials[0]).expect("it simulates");
    assert!(Arc::ptr_eq(&known, &round), "what was looked at whole is not looked at again");

    let anew = search().round_against(&declared, &round.trials[0]).expect("it simulates");
    // Of each place the best stays: the sensor has one alone, and at the joint a constant force is far behind.
    let gain = |name: &str| anew.screened.iter().find(|s| s.added.candidate.effect.name() == name).expect(name).gain;
    assert!(gain("constant-force") < 0.02 * gain("coulomb-friction"), "{}", gain("constant-force"));
    assert_eq!(names(&anew), ["coulomb-friction", "asymmetric-friction", "sensor-bias"]);
}

#[test]
fn what_an_effect_gains_is_told_over_the_windows_of_the_model_without_it() {
    let subject = subject(PENDULUM, &[17.0, 0.2, 0.9, 0.0], 2, vec![swing()]);
    let simulations = Meter::new(&());
    let some = catalogue(&["coulomb-friction"]);
    let search = Search::new(&subject, &some, Limits::at(0.01), &simulations);
    let declared = search.declared(&base::fit(&subject, 1, &simulations).expect("it simulates")).expect("it simulates");
    let round = search.round(&declared).expect("it simulates");
    let tuners = &declared.fitted.point.globals;
    let locals = base::first_locals(&search.pieces(4));
    let windows = search.trial(&[], tuners, locals, 4, 40).expect("it simulates");
    let own = &round.trials[0];
    let of = Dispersion::of(own);
    // Windows forgive much of what whole records show.
    let mixed = criterion(&windows, &of) - criterion(own, &of);
    let whole = criterion(&declared, &of) - criterion(own, &of);
    let mut apart = Round::clone(&round);
    apart.from = windows;
    let rounds = [Arc::new(apart)];
    let told = Standing::of(&search, &rounds, own, 0).expect("it was tried").gains[0];
    assert!(mixed < told && told < whole, "{mixed} {told} {whole}");
}

/// A tank that empties through an orifice: `x' = u - a sqrt(x)`.
const TANK: &str = r#"
states     = { x = "cm" }
inputs     = { u = "cm/s" }
parameters = { a = "cm^0.5/s" }
der        = { x = "x' = u - a*sqrt(max(x, 0))" }
"#;

#[test]
fn what_the_linear_view_has_as_near_is_held_against_an_effect_although_no_short_fit_tried_it() {
    let step = |t: f64| 1.0 + 0.6 * math::sin(0.3 * t);
    let states =
        integrated(|t, x: &[f64; 2]| [step(t) - 0.4 * math::powf(x[0].max(0.0), 0.7), 0.0], [2.0, 0.0], 0.2, 300);
    let mut record = Record::of_first("x", &states, 0.2, 0.01, "tank");
    let values = record.times.iter().map(|&t| step(t)).collect();
    record.inputs = vec![("u", Input::Sampled { times: record.times.clone(), values, hold: Hold::First })];
    let subject = subject(TANK, &[0.6, 2.0], 1, vec![record]);
    let simulations = Meter::new(&());
    let effects = catalogue(&["linear-loss", "leak", "orifice-exponent"]);
    let search = Search::new(&subject, &effects, Limits { refits: 1, ..Limits::at(0.01) }, &simulations);
    let calibrated = base::fit(&subject, 1, &simulations).expect("it simulates");
    let declared = search.over_or_in_windows(&search.declared(&calibrated).expect("it simulates"));
    let round = search.round(&declared).expect("it simulates");
    let names = |round: &Round<'_>| -> Vec<String> {
        round.trials.iter().filter_map(|t| Some(t.newest()?.effect.name().to_owned())).collect()
    };
    // Room for two at a place; the third gains nearly as much.
    assert_eq!(names(&round), ["orifice-exponent", "linear-loss"]);
    assert!(round.screened[2].gain > 0.9 * round.screened[0].gain);
    let rivals = search.held_against_rivals(&round.trials[0]);
    assert_eq!(names(&rivals[0]), ["orifice-exponent", "linear-loss", "leak"]);
}
