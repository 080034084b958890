//! Selections on data that the tests compute themselves.

use mops_core::{Input, Role, case::Hold, task::DiagnosisTask};
use mops_math as math;

use super::baseline::baseline;
use super::fitted_set::name;
use super::{Conclusion, FittedSet, FittedSets, Forecasts, Key, Verdict};
use crate::estimation::ErrorModel;
use crate::fit::Meter;
use crate::records::Subject;
use crate::testing::{Parts, Record, catalogue, integrated, selected, subject, white};
use crate::{Options, diagnose};

const OSCILLATOR: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { d = "N s/m", k = "N/m" }
der        = { x = "v", v = "1 [kg]*v' = u - d*v - k*x" }
"#;

/// Effects that are tried: the simplest of each class.
const TRIED: [&str; 8] = [
    "coulomb-friction",
    "quadratic-drag",
    "cubic-stiffness",
    "constant-force",
    "sensor-gain",
    "sensor-lag",
    "input-dead-zone",
    "wind-gust",
];

const NOISE: f64 = 5e-3;
const STEP: f64 = 0.05;
const COUNT: usize = 300;

/// Oscillator with a further force, driven by two sines, measured with white noise and an error that is correlated over
/// 0.5 s.
fn recorded(force: fn(x: f64, v: f64) -> f64, correlated: f64, roles: &[Role], start: &[f64; 4]) -> Subject {
    let record = |number: usize| {
        #[allow(clippy::cast_precision_loss)]
        let drive = |t: f64| {
            2.0 * math::sin((1.3 + 0.4 * number as f64) * t) + 1.5 * math::sin((2.9 - 0.5 * number as f64) * t + 1.0)
        };
        #[allow(clippy::cast_precision_loss)]
        let times: Vec<f64> = (0..COUNT).map(|k| k as f64 * STEP).collect();
        let fixed = |t: f64| drive((t / STEP).floor() * STEP);
        let rates = |t: f64, s: &[f64; 2]| [s[1], fixed(t) - 0.3 * s[1] - 4.0 * s[0] + force(s[0], s[1])];
        let states = integrated(rates, [0.5, 0.0], STEP, COUNT);
        let label = format!("selection {number}");
        let (fast, slow) = (white(&label, NOISE, COUNT), white(&format!("{label} slow"), 1.0, COUNT));
        let (decay, mut error) = (math::exp(-STEP / 0.5), 0.0);
        let values = states.iter().zip(fast).zip(slow).map(|((s, fast), slow)| {
            error = decay * error + correlated * (1.0 - decay * decay).sqrt() * slow;
            s[0] + fast + error
        });
        let input = Input::Sampled {
            times: times.clone(),
            values: times.iter().map(|&t| drive(t)).collect(),
            hold: Hold::Zero,
        };
        Record { inputs: vec![("u", input)], signals: vec![("x", values.collect(), NOISE)], times }
    };
    let mut subject = subject(OSCILLATOR, start, 2, (0..roles.len()).map(record).collect());
    for (measurement, role) in subject.measurements.iter_mut().zip(roles) {
        measurement.role = *role;
    }
    subject
}

fn look_at(
    force: fn(x: f64, v: f64) -> f64,
    correlated: f64,
    roles: &[Role],
    look: impl FnOnce(&FittedSets<'_, '_>, &Forecasts, &Verdict),
) {
    let subject = recorded(force, correlated, roles, &[0.2, 5.0, 0.4, 0.1]);
    selected(&subject, &catalogue(&TRIED), look);
}

/// Returns the names of the effects of a set, `effect@place` each.
fn names(sets: &FittedSets<'_, '_>, key: &Key) -> Vec<String> {
    key.iter().map(|&k| name(&sets.refit.candidates[k], sets.refit.subject)).collect()
}

#[test]
fn the_baseline_is_found_from_a_start_that_is_far_off() {
    // A stiffness of 40 N/m oscillates three times as fast: the record of 15 s has many local minima in between.
    let subject = recorded(|_, _| 0.0, 0.0, &BOTH[..1], &[3.0, 40.0, -0.4, 0.1]);
    let found = baseline(&subject, &Meter::new(&())).expect("it simulates");
    // Data of the drawn record hold 0.3 N s/m and 4 N/m; the noise leaves them uncertain by less than 1 %.
    assert!((found.tuners[0] - 0.3).abs() < 0.01 && (found.tuners[1] - 4.0).abs() < 0.02, "{:?}", found.tuners);
}

const BOTH: [Role; 2] = [Role::Calibration, Role::Selection];

fn spring(x: f64, _: f64) -> f64 {
    -2.0 * x * x * x
}

#[test]
fn a_missing_effect_is_claimed_by_class_and_place() {
    look_at(spring, 0.0, &BOTH, |sets, forecasts, verdict| {
        assert_eq!(names(sets, &verdict.set), ["cubic-stiffness@joint:x"]);
        let stated = &verdict.stated[0];
        assert!(verdict.conclusion == Conclusion::Effect && verdict.is_first && stated.is_claimed, "{verdict:?}");
        assert_eq!((stated.entry.class.as_str(), stated.entry.place.as_str()), ("elastic", "joint:x"));
        assert!((0.9..=0.95).contains(&stated.probability), "{verdict:?}");
        assert!(forecasts.share_of_declared(sets, &verdict.set).is_some_and(|share| share > 0.99), "{verdict:?}");
        let curves = sets.free_curves(&Key::new());
        let curve = curves.first().expect("the joint moves");
        assert!(curve.to_string() == "position at joint:x" && curve.gain > 20.0, "{curve:?}");
        assert!(verdict.remaining.first().is_some_and(|curve| curve.gain < 3.0), "{verdict:?}");
    });
}

#[test]
fn where_nothing_is_missing_nothing_is_claimed_and_what_is_correlated_stays_unexplained() {
    for (correlated, expected) in [(0.0, Conclusion::None), (6.0 * NOISE, Conclusion::Unexplained)] {
        look_at(
            |_, _| 0.0,
            correlated,
            &BOTH,
            |sets, _, verdict| {
                assert_eq!(verdict.conclusion, expected, "{correlated}: {verdict:?}");
                assert!(verdict.nothing > 0.9, "{correlated}: {verdict:?}");
                let curves = sets.free_curves(&Key::new());
                assert!(curves.first().is_none_or(|curve| curve.gain < 6.0), "{curves:?}");
            },
        );
    }
}

#[test]
fn without_another_record_the_end_of_the_same_one_decides() {
    look_at(spring, 2.0 * NOISE, &BOTH[..1], |sets, _, verdict| {
        assert_eq!(names(sets, &verdict.set), ["cubic-stiffness@joint:x"]);
        assert_eq!(verdict.conclusion, Conclusion::Effect, "{verdict:?}");
    });
}

#[test]
fn no_set_fits_worse_than_one_that_it_contains() {
    look_at(spring, 6.0 * NOISE, &BOTH, |sets, _, _| {
        let log = |set: &FittedSet<'_>, kind: Option<ErrorModel>| match kind {
            Some(kind) => set.estimate(kind).map(|estimate| estimate.log_likelihood),
            None => Some(set.least_squares.log_likelihood),
        };
        let mut compared = 0;
        for larger in &sets.sets {
            let contains = |smaller: &&FittedSet<'_>| {
                smaller.key.len() < larger.key.len() && smaller.key.iter().all(|k| larger.key.contains(k))
            };
            for smaller in sets.sets.iter().filter(contains) {
                for kind in ErrorModel::ALL.into_iter().map(Some).chain([None]) {
                    let Some((own, theirs)) = log(larger, kind).zip(log(smaller, kind)) else { continue };
                    // The priors of the further parameters may cost as much as they gain.
                    assert!(own > theirs - 1.0, "{kind:?} {:?} {own} {:?} {theirs}", larger.key, smaller.key);
                    compared += 1;
                }
            }
        }
        assert!(compared > 4, "{compared}");
    });
}

#[test]
fn given_effects_are_in_every_set_and_the_search_adds_others() {
    let both = |x: f64, v: f64| spring(x, v) - 0.4 * v * v.abs();
    let subject = recorded(both, 0.0, &BOTH, &[0.2, 5.0, 0.4, 0.1]);
    let diagnosed = |with: &str| {
        let task = DiagnosisTask { with: vec![with.to_owned()], ..DiagnosisTask::default() };
        diagnose(
            &Parts { task, ..Parts::of(&subject) }.study(&subject),
            &catalogue(&TRIED),
            &Options { max_effects: 2, level: 0.05, ..Options::default() },
            &(),
        )
    };
    let found = diagnosed("cubic-stiffness@joint:x").expect("it simulates").found;
    assert_eq!(found.iter().map(|f| f.effect.as_str()).collect::<Vec<_>>(), ["cubic-stiffness", "quadratic-drag"]);
    assert!(found[0].given && !found[0].claimed && !found[1].given && found[1].claimed, "{found:?}");
    let refused = diagnosed("cubic-stifness@joint:x").expect_err("there is no such effect");
    assert!(refused.to_string().contains("no effect `cubic-stifness@joint:x`"), "{refused}");
}

#[test]
fn effects_that_the_records_cannot_distinguish_are_one_claim() {
    // A position about which the spring pulls can be anywhere: a constant force is a bias of the sensor.
    let subject = recorded(|_, _| 0.6, 0.0, &BOTH, &[0.2, 5.0, 0.4, 0.1]);
    let tried = catalogue(&["constant-force", "sensor-bias", "input-bias", "quadratic-drag"]);
    let verdict = selected(&subject, &tried, |_, _, verdict| verdict.clone());
    assert_eq!(verdict.conclusion, Conclusion::Effect);
    let stated = &verdict.stated[0];
    let mut places: Vec<&str> = stated.alike.iter().chain([&stated.entry]).map(|entry| entry.place.as_str()).collect();
    places.sort_unstable();
    assert_eq!(places, ["actuator:u", "joint:x", "sensor:x"], "{verdict:?}");
    assert!(stated.is_claimed && stated.probability >= 0.9, "{verdict:?}");
}
