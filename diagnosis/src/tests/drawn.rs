//! What was found is drawn through the signal that the data show at its place without any formula.

use mops_math as math;
use mops_outcome::diagnosis::{Curve, LatentInput, Verdict};

use crate::testing::{Record, catalogue, integrated, study, subject};
use crate::{Options, diagnose};

/// A block on a spring: `v' = -k x - d v`.
const BLOCK: &str = r#"
states     = { x = "m", v = "m/s" }
parameters = { k = "1/s^2", d = "1/s" }
der        = { x = "v", v = "v' = -k*x - d*v" }
"#;
const NOISE: f64 = 0.002;

/// Returns the latent input at the place of one effect of the catalogue that is looked for in the records.
fn at_the_effect(name: &str, records: Vec<Record>) -> LatentInput {
    let subject = subject(BLOCK, &[8.0, 0.5, 1.0, 0.0], 2, records);
    let options = Options { max_effects: 1, level: 0.01, ..Options::default() };
    let diagnosis = diagnose(&study(&subject), &catalogue(&[name]), &options, &()).expect("it simulates");
    let place = diagnosis.found.first().expect("it is found").place.clone();
    diagnosis.latent.into_iter().find(|latent| latent.place == place).expect("the place of an effect has one")
}

fn rms(curve: &Curve, of: impl Fn(f64, f64, f64) -> Option<f64>) -> f64 {
    let points = curve.x.iter().zip(curve.estimated.iter().zip(&curve.found));
    let errors: Vec<f64> = points.filter_map(|(&x, (&estimated, &found))| of(x, estimated, found)).collect();
    assert!(errors.len() > 50, "{}", errors.len());
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn dry_friction_is_drawn_over_the_speed_and_the_estimate_follows_it() {
    const FRICTION: f64 = 0.4;
    let slid = |label: &str, start: f64| {
        let rates = |_: f64, x: &[f64; 2]| [x[1], -9.0 * x[0] - 0.1 * x[1] - FRICTION * math::tanh(x[1] / 1e-3)];
        Record::of_first("x", &integrated(rates, [start, 0.0], 0.02, 150), 0.02, NOISE, label)
    };
    let latent = at_the_effect("coulomb-friction", vec![slid("one", 1.0), slid("other", -1.5)]);
    let (_, _, over_speed) = latent.over.iter().find(|(over, ..)| over == "speed").expect("it moves");
    let fast = |v: f64| (v.abs() > 0.3).then_some(-FRICTION * v.signum());
    let formula = rms(over_speed, |v, _, found| Some(found - fast(v)?));
    let estimate = rms(over_speed, |v, estimated, _| Some(estimated - fast(v)?));
    // Six bumps follow a jump within a fifth of it.
    assert!(formula < 0.02 * FRICTION && estimate < 0.2 * FRICTION, "{formula}, {estimate}");
    assert_eq!(latent.over_time.len(), 2);
    for (_, over_time) in &latent.over_time {
        assert_eq!(over_time.found.len(), over_time.x.len());
        let apart = rms(over_time, |_, estimated, found| Some(estimated - found));
        assert!(apart < 0.3 * FRICTION, "{apart}");
    }
}

#[test]
fn a_drift_is_drawn_at_its_sensor_in_the_unit_of_the_sensor() {
    const DRIFT: f64 = 0.02;
    let mut states = integrated(|_, x: &[f64; 2]| [x[1], -9.0 * x[0] - 0.1 * x[1]], [1.0, 0.0], 0.02, 250);
    states.iter_mut().zip(0_u8..).for_each(|(state, k)| state[0] += DRIFT * 0.02 * f64::from(k));
    let record = Record::of_first("x", &states, 0.02, NOISE, "drift");
    let latent = at_the_effect("sensor-drift", vec![record]);
    let over_time = &latent.over_time[0].1;
    let formula = rms(over_time, |t, _, found| Some(found - DRIFT * t));
    let estimate = rms(over_time, |t, estimated, _| Some(estimated - DRIFT * t));
    assert!(formula < NOISE && estimate < NOISE, "{formula}, {estimate}");
}

#[test]
fn what_no_effect_explains_has_a_course_at_the_place_where_it_acts() {
    const FRICTION: f64 = 0.4;
    let rates = |_: f64, x: &[f64; 2]| [x[1], -9.0 * x[0] - 0.1 * x[1] - FRICTION * math::tanh(x[1] / 1e-3)];
    let states = integrated(rates, [1.0, 0.0], 0.02, 150);
    let record = Record::of_first("x", &states, 0.02, NOISE, "unexplained");
    let subject = subject(BLOCK, &[8.0, 0.5, 1.0, 0.0], 2, vec![record]);
    let options = Options { max_effects: 1, level: 0.01, ..Options::default() };
    let diagnosis = diagnose(&study(&subject), &catalogue(&["sensor-gain"]), &options, &()).expect("it simulates");
    assert_eq!(diagnosis.verdict, Verdict::Unexplained);
    assert!(diagnosis.found.is_empty(), "{:?}", diagnosis.found);
    assert_eq!((diagnosis.places[0].place.as_str(), diagnosis.latent.len()), ("joint:x", 1));
    let course = &diagnosis.latent[0].over_time[0].1;
    assert!(course.x.len() > 50 && course.estimated.len() == course.x.len() && course.found.is_empty(), "{course:?}");
}
