//! Selections on data that the tests compute themselves.

use mops_core::{Input, Role, Study, case::Hold, task::DiagnosisTask};
use mops_math as math;

use super::baseline::baseline;
use super::{Conclusion, Selection, compare, select};
use crate::estimation::ErrorModel;
use crate::meter::Meter;
use crate::subject::Subject;
use crate::testing::{Record, catalogue, integrated, study, subject, white};
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

/// Oscillator with a further force, driven by two sines, measured with white noise and an error that is correlated over 0.5 s.
fn recorded(force: fn(x: f64, v: f64) -> f64, correlated: f64, roles: &[Role], start: &[f64; 4]) -> Subject {
    let record = |number: usize| {
        #[allow(clippy::cast_precision_loss)]
        let drive = |t: f64| {
            2.0 * math::sin((1.3 + 0.4 * number as f64) * t) + 1.5 * math::sin((2.9 - 0.5 * number as f64) * t + 1.0)
        };
        #[allow(clippy::cast_precision_loss)]
        let times: Vec<f64> = (0..COUNT).map(|k| k as f64 * STEP).collect();
        let held = |t: f64| drive((t / STEP).floor() * STEP);
        let rates = |t: f64, s: &[f64; 2]| [s[1], held(t) - 0.3 * s[1] - 4.0 * s[0] + force(s[0], s[1])];
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

fn selected(force: fn(x: f64, v: f64) -> f64, correlated: f64, roles: &[Role]) -> Selection {
    let subject = recorded(force, correlated, roles, &[0.2, 5.0, 0.4, 0.1]);
    select(&study(&subject), &catalogue(&TRIED)).expect("it simulates")
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
    let found = selected(spring, 0.0, &BOTH);
    assert_eq!(found.found, ["cubic-stiffness@joint:x"]);
    let verdict = &found.verdict;
    let stated = &verdict.stated[0];
    assert!(
        verdict.conclusion == Conclusion::Effect
            && verdict.is_first
            && stated.is_claimed
            && stated.entry.class == "elastic"
            && stated.entry.place == "joint:x",
        "{verdict:?}"
    );
    assert!(
        (0.9..=0.95).contains(&stated.probability) && verdict.share.is_some_and(|share| share > 0.99),
        "{verdict:?}"
    );
    let curve = verdict.declared[0].first().expect("the joint moves");
    assert!(curve.to_string() == "position at joint:x" && curve.gain > 20.0, "{curve:?}");
    assert!(verdict.remaining.first().is_some_and(|curve| curve.gain < 3.0), "{verdict:?}");
}

#[test]
fn where_nothing_is_missing_nothing_is_claimed_and_what_is_correlated_stays_unexplained() {
    for (correlated, expected) in [(0.0, Conclusion::None), (6.0 * NOISE, Conclusion::Unexplained)] {
        let found = selected(|_, _| 0.0, correlated, &BOTH);
        assert_eq!(found.verdict.conclusion, expected, "{correlated}: {:?}", found.verdict);
        assert!(found.verdict.nothing > 0.9, "{correlated}: {:?}", found.verdict);
        assert!(found.verdict.declared[0].first().is_none_or(|curve| curve.gain < 6.0), "{:?}", found.verdict.declared);
    }
}

#[test]
fn without_another_record_the_end_of_the_same_one_decides() {
    let found = selected(spring, 2.0 * NOISE, &BOTH[..1]);
    assert!(
        found.verdict.conclusion == Conclusion::Effect && found.found == ["cubic-stiffness@joint:x"],
        "{:?} {:?}",
        found.found,
        found.verdict
    );
}

#[test]
fn no_set_fits_worse_than_one_that_it_contains() {
    let found = selected(spring, 6.0 * NOISE, &BOTH);
    let log =
        |set: &super::SetOfEffects, kind| set.fits.iter().find(|fit| fit.kind == kind).map(|fit| fit.log_likelihood);
    let mut compared = 0;
    for larger in &found.sets {
        for smaller in &found.sets {
            if smaller.effects.len() >= larger.effects.len()
                || !smaller.effects.iter().all(|e| larger.effects.contains(e))
            {
                continue;
            }
            for kind in ErrorModel::ALL.into_iter().map(Some).chain([None]) {
                if let (Some(larger_log), Some(smaller_log)) = (log(larger, kind), log(smaller, kind)) {
                    // The priors of the further parameters may cost as much as they gain.
                    let least = smaller_log - 1.0;
                    assert!(
                        larger_log > least,
                        "{kind:?} {:?} {larger_log} {:?} {smaller_log}",
                        larger.effects,
                        smaller.effects
                    );
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 4, "{compared}");
}

#[test]
fn given_sets_are_fitted_from_smaller_ones_and_unknown_names_are_refused() {
    let subject = subject(
        OSCILLATOR,
        &[0.3, 4.0, 0.5, 0.0],
        2,
        vec![Record::of_first("x", &[[0.5, 0.0]; 40], 0.05, NOISE, "names")],
    );
    let names = |sets: &[&[&str]]| {
        let owned = |set: &&[&str]| set.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        sets.iter().map(owned).collect::<Vec<_>>()
    };
    let (study, effects) = (study(&subject), catalogue(&["constant-force", "quadratic-drag"]));
    let pair = ["constant-force@joint:x", "quadratic-drag@joint:x"];
    let found = compare(&study, &effects, &names(&[&pair[..1], &pair])).expect("each is known");
    assert!(found.sets.iter().any(|set| set.effects.len() == 2));
    for unknown in [&["drag@joint:x"][..], &pair] {
        let refused = compare(&study, &effects, &names(&[unknown]));
        assert!(refused.is_err_and(|error| error.to_string().contains("cannot fit")), "{unknown:?}");
    }
}

#[test]
fn given_effects_are_in_every_set_and_the_search_adds_others() {
    let both = |x: f64, v: f64| spring(x, v) - 0.4 * v * v.abs();
    let subject = recorded(both, 0.0, &BOTH, &[0.2, 5.0, 0.4, 0.1]);
    let diagnosed = |with: &str| {
        let mut parts = study(&subject).into_parts();
        parts.task = DiagnosisTask { with: vec![with.to_owned()], ..DiagnosisTask::default() }.into();
        diagnose(&Study::from_parts(parts), &catalogue(&TRIED), &Options { max_effects: 2, level: 0.05 }, &())
    };
    let found = diagnosed("cubic-stiffness@joint:x").expect("it simulates").found;
    assert_eq!(found.iter().map(|f| f.effect.as_str()).collect::<Vec<_>>(), ["cubic-stiffness", "quadratic-drag"]);
    assert!(found[0].given && !found[0].claimed && !found[1].given && found[1].claimed, "{found:?}");
    let refused = diagnosed("cubic-stifness@joint:x").expect_err("there is no such effect");
    assert!(refused.to_string().contains("no effect `cubic-stifness@joint:x`"), "{refused}");
}

#[test]
fn effects_that_the_records_cannot_tell_apart_are_one_claim() {
    // A position about which the spring pulls can be anywhere: a constant force is a bias of the sensor.
    let subject = recorded(|_, _| 0.6, 0.0, &BOTH, &[0.2, 5.0, 0.4, 0.1]);
    let tried = catalogue(&["constant-force", "sensor-bias", "input-bias", "quadratic-drag"]);
    let verdict = select(&study(&subject), &tried).expect("it simulates").verdict;
    assert_eq!(verdict.conclusion, Conclusion::Effect);
    let stated = &verdict.stated[0];
    let mut places: Vec<&str> = stated.alike.iter().chain([&stated.entry]).map(|entry| entry.place.as_str()).collect();
    places.sort_unstable();
    assert_eq!(places, ["actuator:u", "joint:x", "sensor:x"], "{verdict:?}");
    assert!(stated.is_claimed && stated.probability >= 0.9, "{verdict:?}");
}
