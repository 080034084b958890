//! Place, coordinate and course of what is missing, on a mass with spring and damper behind a slow motor; the data come
//! from equations of their own.

use mops_core::{Input, case::Hold};
use mops_math as math;
use mops_outcome::diagnosis::{Dependence, LatentInput};

use super::latent_inputs;
use crate::fit::Meter;
use crate::records::Subject;
use crate::selection::prepare;
use crate::testing::{Record, integrated, subject, white};

const PLANT: &str = r#"
states     = { x = "m", v = "m/s", f = "N" }
inputs     = { u = "N" }
parameters = { m = "kg", d = "N s/m", k = "N/m", tau = "s" }
der        = { x = "v", v = "m*v' = f - d*v - k*x", f = "tau*f' = u - f" }
"#;

/// Mass, damping, stiffness, time constant; initial states.
const TRUTH: [f64; 7] = [2.0, 0.8, 40.0, 0.15, 0.0, 0.0, 0.0];
const STEP: f64 = 0.01;
const COUNT: usize = 600;
const NOISE: [f64; 2] = [2e-4, 5e-3];

/// What the data have that the model lacks.
#[derive(Default, Clone, Copy)]
struct Hidden {
    force: Option<fn(f64, &[f64; 3]) -> f64>,
    actuator: Option<fn(f64) -> f64>,
    sensor: Option<fn(f64, f64) -> f64>,
}

fn times() -> Vec<f64> {
    (0..COUNT).map(|k| k as f64 * STEP).collect()
}

/// Returns a rich input: steps of 0.25 s that never repeat.
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

/// Returns the free curves on the declared model under its likeliest error model, the one with the largest gain first,
/// and the course at a place.
fn missing(subject: &Subject, place: &str) -> (Vec<Dependence>, LatentInput) {
    let simulations = Meter::new(&());
    let (refit, mut declared) = prepare(subject, &[], &simulations).expect("it simulates");
    refit.under_error_models(&mut declared, &[], f64::NEG_INFINITY);
    let (_, likeliest) = declared.likeliest().expect("it was fitted");
    let curves = declared.estimation(&refit.nominal).curves(likeliest).expect("it simulates");
    let ports = &subject.model.interface().ports;
    let port = ports.iter().find(|port| port.to_string() == place).expect("the model has it");
    let mut courses = latent_inputs(&[port], [&declared, &declared], &refit.nominal);
    (curves, courses.pop().expect("the place has one"))
}

fn bump(t: f64) -> f64 {
    3.0 * math::exp(-math::powi((t - 3.0) / 0.3, 2))
}

#[test]
fn a_force_pulse_has_its_course_at_its_joint() {
    let hidden = Hidden { force: Some(|t, _| bump(t)), ..Hidden::default() };
    let (_, latent) = missing(&plant(hidden, "pulse"), "joint:x");
    let course = &latent.over_time[0].1;
    let error = course.x.iter().zip(&course.estimated).map(|(&t, f)| math::powi(f - bump(t), 2)).sum::<f64>()
        / course.x.len() as f64;
    // The fit without the force has other parameters.
    assert!(error.sqrt() < 0.1 * 3.0, "{}", error.sqrt());
    assert_eq!((latent.unit.as_str(), course.found.len()), ("N", 0));
}

#[test]
fn dry_friction_depends_on_the_speed_of_its_joint_and_jumps_where_that_changes_its_sign() {
    let friction = |_: f64, x: &[f64; 3]| -0.6 * math::tanh(x[1] / 1e-3);
    let (curves, latent) = missing(&plant(Hidden { force: Some(friction), ..Hidden::default() }, "dry"), "joint:x");
    assert_eq!((curves[0].coordinate.as_str(), curves[0].place.as_str()), ("speed", "joint:x"), "{:?}", curves[0]);
    // What is linear in the speed is in the damping of the fit; about rest the fit turns back a little early or late.
    let (_, _, over_speed) = latent.over.iter().find(|(over, ..)| over == "speed").expect("it moves");
    let points = over_speed.x.iter().zip(&over_speed.estimated);
    let fastest = over_speed.x.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let mean = |side: f64| {
        let slow = points.clone().filter(|(v, _)| (0.08..0.2).contains(&(side * **v / fastest))).map(|(_, f)| *f);
        slow.clone().sum::<f64>() / slow.count() as f64
    };
    let jump = mean(1.0) - mean(-1.0);
    // A smooth force follows the jump of 1.2 N halfway.
    assert!((-1.5..-0.5).contains(&jump), "{jump}");
}

#[test]
fn a_dead_zone_depends_on_the_input() {
    let dead = |u: f64| u.signum() * (u.abs() - 1.0).max(0.0);
    let (curves, _) = missing(&plant(Hidden { actuator: Some(dead), ..Hidden::default() }, "dead"), "joint:x");
    assert_eq!((curves[0].coordinate.as_str(), curves[0].place.as_str()), ("input", "actuator:u"), "{:?}", curves[0]);
}

#[test]
fn a_swing_of_a_sensor_has_its_course_there() {
    let swing = |t: f64| 2e-3 * math::sin(0.9 * t);
    let sensor = |t: f64, x: f64| x + 2e-3 * math::sin(0.9 * t);
    let (_, latent) = missing(&plant(Hidden { sensor: Some(sensor), ..Hidden::default() }, "swing"), "sensor:x");
    let course = &latent.over_time[0].1;
    let error = course.x.iter().zip(&course.estimated).map(|(&t, e)| math::powi(e - swing(t), 2)).sum::<f64>();
    let error = (error / course.x.len() as f64).sqrt();
    assert!(error < 0.2 * 2e-3, "{error}");
    assert_eq!(latent.unit, "m");
}

#[test]
fn white_residuals_depend_on_nothing() {
    let (curves, _) = missing(&plant(Hidden::default(), "white"), "joint:x");
    assert!(curves.iter().all(|curve| curve.gain < 4.0), "{:?}", curves[0]);
}
