//! Places of residuals, on a mass with spring and damper behind a slow motor; the data come from equations of their own.

use mops_core::{Input, case::Hold};
use mops_math as math;
use mops_outcome::diagnosis::Evidence;

use crate::locate::{Located, locate};
use crate::meter::Meter;
use crate::subject::Subject;
use crate::testing::{Record, fitted, integrated, subject, white};

const PLANT: &str = r#"
states     = { x = "m", v = "m/s", f = "N" }
inputs     = { u = "N" }
parameters = { m = "kg", d = "N s/m", k = "N/m", tau = "s" }
der        = { x = "v", v = "m*v' = f - d*v - k*x", f = "tau*f' = u - f" }
"#;

/// Mass, damping, stiffness, time constant; start values.
const TRUTH: [f64; 7] = [2.0, 0.8, 40.0, 0.15, 0.0, 0.0, 0.0];
const STEP: f64 = 0.01;
const COUNT: usize = 600;
const NOISE: [f64; 2] = [2e-4, 5e-3];

/// What the data have that the model has not.
#[derive(Default, Clone, Copy)]
struct Hidden {
    force: Option<fn(f64, &[f64; 3]) -> f64>,
    actuator: Option<fn(f64) -> f64>,
    sensor: Option<fn(f64, f64) -> f64>,
}

fn times() -> Vec<f64> {
    (0..COUNT).map(|k| k as f64 * STEP).collect()
}

/// A rich input: steps of 0.25 s that never repeat.
fn command(t: f64) -> f64 {
    let k = (t / 0.25 + 1e-7).floor();
    8.0 * math::sin(1.0 + k * 0.7) * (0.4 + math::cos(2.3 * k))
}

fn plant(hidden: Hidden, label: &str) -> Subject {
    let [m, d, k, tau, ..] = TRUTH;
    let rates = |t: f64, x: &[f64; 3]| {
        let u = hidden.actuator.map_or(command(t), |change| change(command(t)));
        let force = hidden.force.map_or(0.0, |force| force(t, x));
        [x[1], (x[2] - d * x[1] - k * x[0] + force) / m, (u - x[2]) / tau]
    };
    let states = integrated(rates, [0.0; 3], STEP, COUNT);
    let noise = [0, 1].map(|i| white(&format!("{label}{i}"), NOISE[i], COUNT));
    let measured = |t: f64, x: f64| hidden.sensor.map_or(x, |sensor| sensor(t, x));
    let x = states.iter().zip(times()).zip(&noise[0]).map(|((s, t), e)| measured(t, s[0]) + e).collect();
    let f = states.iter().zip(&noise[1]).map(|(s, e)| s[2] + e).collect();
    let input = Input::Sampled { times: times(), values: times().into_iter().map(command).collect(), hold: Hold::Zero };
    let record =
        Record { inputs: vec![("u", input)], times: times(), signals: vec![("x", x, NOISE[0]), ("f", f, NOISE[1])] };
    let guess = TRUTH.map(|p| 1.1 * p);
    subject(PLANT, &guess, 3, vec![record])
}

/// Places, best first.
fn places(subject: &Subject) -> Vec<Located> {
    let simulations = Meter::new(&());
    let (fit, variant, _, scene) = fitted(subject, &simulations);
    locate(&fit, &variant.model, &scene)
}

fn shown(found: &[Located]) -> Vec<(&str, f64, f64, f64)> {
    let of = |e: &'_ Evidence| (e.evidence, e.share, e.freedom);
    found.iter().map(|l| (l.evidence.place.as_str(), of(&l.evidence).0, of(&l.evidence).1, of(&l.evidence).2)).collect()
}

fn bump(t: f64) -> f64 {
    3.0 * math::exp(-math::powi((t - 3.0) / 0.3, 2))
}

#[test]
fn a_force_pulse_is_found_at_its_joint_with_its_shape() {
    let found = places(&plant(Hidden { force: Some(|t, _| bump(t)), ..Hidden::default() }, "pulse"));
    let best = &found[0].evidence;
    assert_eq!(best.place, "joint:x", "{:?}", shown(&found));
    assert!(best.share > 0.99 && best.evidence > found[1].evidence.evidence + 20.0, "{:?}", shown(&found));
    let curve = &best.over_time[0].1;
    let error = curve.x.iter().zip(&curve.estimated).map(|(&t, f)| math::powi(f - bump(t), 2)).sum::<f64>()
        / curve.x.len() as f64;
    // What is left is of second order: the fit without the force has other parameters.
    assert!(error.sqrt() < 0.08 * 3.0, "{}", error.sqrt());
    assert_eq!(best.unit, "N");
}

#[test]
fn dry_friction_is_found_at_its_joint_as_a_function_of_the_speed() {
    let friction = |_: f64, x: &[f64; 3]| -0.6 * math::tanh(x[1] / 1e-3);
    let found = places(&plant(Hidden { force: Some(friction), ..Hidden::default() }, "dry"));
    assert_eq!(found[0].evidence.place, "joint:x", "{:?}", shown(&found));
    // What is linear in the speed is in the damping of the fit; about rest the fit turns back a little early or late.
    let (_, _, over_speed) = found[0].evidence.over.iter().find(|(over, ..)| over == "speed").expect("it moves");
    let points = over_speed.x.iter().zip(&over_speed.estimated);
    let fastest = over_speed.x.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let mean = |side: f64| {
        let slow = points.clone().filter(|(v, _)| (0.08..0.2).contains(&(side * **v / fastest))).map(|(_, f)| *f);
        slow.clone().sum::<f64>() / slow.count() as f64
    };
    let jump = mean(1.0) - mean(-1.0);
    assert!((jump + 1.2).abs() < 0.3, "{jump}");
}

#[test]
fn a_dead_zone_is_found_at_the_actuator_as_a_function_of_the_input() {
    let dead = |u: f64| u.signum() * (u.abs() - 1.0).max(0.0);
    let found = places(&plant(Hidden { actuator: Some(dead), ..Hidden::default() }, "dead"));
    assert_eq!(found[0].evidence.place, "actuator:u", "{:?}", shown(&found));
}

#[test]
fn a_drift_is_found_at_the_sensor() {
    let found = places(&plant(Hidden { sensor: Some(|t, x| x + 2e-3 * t), ..Hidden::default() }, "drift"));
    assert_eq!(found[0].evidence.place, "sensor:x", "{:?}", shown(&found));
    assert!(found[0].evidence.freedom < 10.0, "{:?}", shown(&found));
}

#[test]
fn white_residuals_speak_for_no_place() {
    let found = places(&plant(Hidden::default(), "white"));
    assert!(found.iter().all(|l| l.evidence.evidence < 4.0), "{:?}", shown(&found));
}
