//! Selection data help to choose; parameters come from calibration data; validation data decide nothing.

use std::sync::Arc;

use mops_core::math;
use mops_core::{Effect, Hold, Input, Role};

use crate::base;
use crate::growth::Growth;
use crate::meter::Meter;
use crate::round::Round;
use crate::search::{Limits, Search, Trial};
use crate::standing::Standing;
use crate::subject::Subject;
use crate::testing::{Record, catalogue, integrated, study, subject, white};
use crate::weigh::{Dispersion, criterion, probabilities};
use crate::{Diagnosis, Options, Verdict, diagnose};
use mops_core::diagnosis::StrengthValue;

/// A block that slides on without friction, of which the data have some of the air: `v' = -k v |v|`.
const BLOCK: &str = r#"
states     = { x = "m", v = "m/s" }
parameters = { a = "m/s^2" }
der        = { x = "v", v = "v' = a" }
"#;
const DRAG: f64 = 0.2;
const NOISE: f64 = 0.01;

fn slide(label: &str, speed: f64, duration: f64) -> Record {
    const COUNT: u32 = 120;
    let step = duration / f64::from(COUNT - 1);
    let states = integrated(|_, x: &[f64; 2]| [x[1], -DRAG * x[1] * x[1].abs()], [0.0, speed], step, COUNT as usize);
    Record::of_first("x", &states, step, NOISE, label)
}

/// Slow slides to calibrate with; a fast one with a role of its own, and one to validate with that is moved by `shift`.
fn block(fast: Role, shift: f64) -> Subject {
    let mut last = slide("last", 3.0, 2.0);
    last.signals[0].1.iter_mut().enumerate().for_each(|(k, x)| *x += shift * math::sin(0.1 * k as f64));
    let mut subject =
        subject(BLOCK, &[-0.01, 0.0, 2.0], 2, vec![slide("slow", 1.5, 2.0), slide("fast", 6.0, 4.0), last]);
    subject.measurements[1].role = fast;
    subject.measurements[2].role = Role::Validation;
    subject
}

fn named() -> Vec<Arc<dyn Effect>> {
    catalogue(&["viscous-friction", "quadratic-drag", "cubic-drag"])
}

fn diagnosis(subject: &Subject) -> Diagnosis {
    diagnose(&study(subject), &named(), &Options { max_effects: 1, level: 0.05, seed: 1 }, &()).expect("it simulates")
}

/// Effects with their probabilities, best first; and what calibration data alone say of the strength of the best.
fn weighed(subject: &Subject) -> (Vec<(String, f64)>, StrengthValue) {
    let simulations = Meter::new(&());
    let (named, limits) = (named(), Limits::at(0.01));
    let search = Search::new(subject, &named, limits, &simulations);
    let calibrated = base::fit(subject, 1, &simulations).expect("it simulates");
    let declared = search.declared(&calibrated).expect("it simulates");
    let round = search.round(&search.over_or_in_windows(&declared)).expect("it simulates");
    let shared = Dispersion::of(&round.trials[0]);
    let shares = probabilities(&round.trials.iter().map(|t| criterion(t, &shared)).collect::<Vec<_>>());
    let names = round.trials.iter().map(|t| t.added[0].candidate.effect.name().to_owned());
    let best = search.calibrate(&round.trials[0], &[]).expect("it simulates");
    let strength = best.strengths(0, &round.trials[0].variant).swap_remove(0);
    (names.zip(shares).collect(), strength)
}

#[test]
fn what_calibration_data_leave_open_selection_data_decide() {
    let (open, alone) = weighed(&block(Role::Validation, 0.0));
    assert!(open[0].1 < 0.95, "{open:?}");
    let (decided, strength) = weighed(&block(Role::Selection, 0.0));
    assert!(decided[0].0 == "quadratic-drag" && decided[0].1 > 0.999, "{decided:?}");
    // Both come from the slow slide, and are as uncertain as that leaves them.
    let error = strength.std_error.expect("it was fitted");
    assert!((strength.value - DRAG).abs() < 4.0 * error && error > 0.001, "{strength:?} {alone:?}");
}

#[test]
#[cfg_attr(not(feature = "full-tests"), ignore = "full tier")]
fn validation_data_change_no_bit_of_what_is_found() {
    let [one, other] = [0.0, 0.5].map(|shift| diagnosis(&block(Role::Selection, shift)));
    assert_eq!(one.found, other.found);
    assert_eq!(one.parameters, other.parameters);
    assert_eq!(one.ranked, other.ranked);
    assert_ne!(one.after[2], other.after[2]);
}

/// A pendulum: `w' = -g sin(th) - b w`.
const PENDULUM: &str = r#"
states     = { th = "rad", w = "rad/s" }
parameters = { g = "1/s^2", b = "1/s" }
der        = { th = "w", w = "w' = -g*sin(th) - b*w" }
"#;

/// Swings with dry friction, and with a bias of the sensor in each session: two to calibrate with, then one to select with.
fn sessions(biases: [f64; 3]) -> Subject {
    let rates = |_: f64, x: &[f64; 2]| [x[1], -17.7 * math::sin(x[0]) - 0.15 * x[1] - 0.5 * math::tanh(x[1] / 1e-3)];
    let record = |(k, bias): (usize, f64)| {
        let states = integrated(rates, [0.8 + 0.1 * k as f64, 0.0], 0.01, 300);
        let mut record = Record::of_first("th", &states, 0.01, NOISE, &format!("session {k}"));
        record.signals[0].1.iter_mut().for_each(|th| *th += bias);
        record
    };
    let mut subject =
        subject(PENDULUM, &[17.0, 0.2, 0.8, 0.0], 2, biases.into_iter().enumerate().map(record).collect());
    subject.measurements[2].role = Role::Selection;
    subject
}

fn with<'a>(search: &Search<'a>, from: &Trial<'a>, name: &str) -> (Trial<'a>, Arc<Round<'a>>) {
    let round = search.round(from).expect("it simulates");
    let is = |t: &&Trial<'_>| t.newest().is_some_and(|newest| newest.effect.name() == name);
    (round.trials.iter().find(is).expect("it was tried").clone(), round)
}

/// A search over sessions with such biases of the sensor, so many samples for selection, a model with Coulomb friction and a bias, and the round that added the
/// bias.
fn with_friction_and_bias<T>(
    biases: [f64; 3],
    selection: usize,
    look: impl for<'a> FnOnce(&Search<'a>, Trial<'a>, Arc<Round<'a>>) -> T,
) -> T {
    let mut subject = sessions(biases);
    let last = &mut subject.measurements[2];
    last.series[0].times.truncate(selection);
    last.series[0].values.truncate(selection);
    let simulations = Meter::new(&());
    let some = catalogue(&["coulomb-friction", "sensor-bias"]);
    let search = Search::new(&subject, &some, Limits::at(0.01), &simulations);
    let calibrated = base::fit(&subject, 1, &simulations).expect("it simulates");
    let declared = search.declared(&calibrated).expect("it simulates");
    let (with_friction, _) = with(&search, &declared, "coulomb-friction");
    let (with_bias, round) = with(&search, &with_friction, "sensor-bias");
    let of = Dispersion::of(&with_bias);
    assert!(criterion(&with_bias, &of) < criterion(&with_friction, &of) - 10.0, "it helps the fit");
    look(&search, with_bias, round)
}

#[test]
#[cfg_attr(not(feature = "full-tests"), ignore = "full tier")]
fn what_helps_the_fit_and_hurts_the_forecast_is_left_out() {
    let left_out_of = |biases: [f64; 3], selection: usize| {
        with_friction_and_bias(biases, selection, |search, with_bias, _| {
            let left = search.forecasting_better(&with_bias)?;
            Some(left.added.iter().map(|a| a.candidate.effect.name()).collect::<Vec<_>>())
        })
    };
    let left_out = |biases: [f64; 3]| left_out_of(biases, 300);
    assert_eq!(left_out([0.004, 0.004, 0.004]), None);
    assert_eq!(left_out([0.004, 0.004, -0.002]), Some(vec!["coulomb-friction"]));
    // Too few samples to see the bias in.
    assert_eq!(left_out_of([0.004, 0.004, -0.002], 20), None);
    // Where the data are not explained without, the forecast of a model that misses something tells nothing.
    assert_eq!(left_out([0.02, 0.02, -0.01]), None);
}

#[test]
fn what_is_left_of_two_effects_stands_in_a_round_without_the_other() {
    with_friction_and_bias([0.004, 0.004, -0.002], 300, |search, last, round| {
        // As if the bias had been found first: no round has the friction alone.
        let (steps, allowed) = (Vec::new(), Vec::new());
        let growth = search.settle(Growth { last, rounds: vec![round], steps, allowed, p_value: 0.0 }, &());
        assert_eq!(growth.last.added.len(), 1, "the bias is left out");
        let standing = Standing::of(search, &growth.rounds, &growth.last, 0).expect("it was tried");
        assert_eq!(standing.round.from.added.len(), 0);
        assert!(standing.probability() > 0.9 && standing.gains[standing.own] > 100.0, "{:?}", standing.gains);
    });
}

/// A gain of a signal that nothing foretells.
const AMPLIFIER: &str = r#"
states     = { x = "V" }
inputs     = { u = "V" }
parameters = { k = "1" }
der        = { x = "x' = -1 [1/s]*x" }
outputs    = { y = { value = "k*u", unit = "V" } }
"#;

#[test]
fn a_model_that_selection_data_contradict_is_not_called_right_although_no_signal_foretells_what_is_left() {
    let record = |label: &str, k: f64| {
        let times: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
        let values = white(label, 1.0, 200);
        let y = values.iter().zip(white(&format!("{label} y"), NOISE, 200)).map(|(u, e)| k * u + e).collect();
        let input = Input::Sampled { times: times.clone(), values, hold: Hold::Zero };
        Record { inputs: vec![("u", input)], times, signals: vec![("y", y, NOISE)] }
    };
    let records = vec![record("amplifier 0", 1.0), record("amplifier 1", 1.0), record("amplifier 2", 1.1)];
    let mut subject = subject(AMPLIFIER, &[0.8, 0.0], 1, records);
    subject.measurements[2].role = Role::Selection;
    let none = diagnose(&study(&subject), &[], &Options { max_effects: 1, level: 0.01, seed: 1 }, &()).unwrap();
    assert_eq!(none.verdict, Verdict::Unexplained, "{none:?}");
}
