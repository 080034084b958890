//! Twins against closed forms, and against themselves with smaller steps.

use mops_math as math;
use mops_testbed::twins::{BODIES, Body, Command, Declared, Site, simulate};

fn body(name: &str) -> &'static Body {
    BODIES.iter().find(|body| body.name == name).unwrap()
}

fn times(end: f64) -> Vec<f64> {
    (1..=50).map(|k| end * f64::from(k) / 50.0).collect()
}

fn constant(value: f64) -> impl Fn(f64) -> f64 {
    move |_| value
}

fn joint(name: &'static str, parameters: &'static [f64]) -> Declared<'static> {
    Declared { name, site: Site::Joint(0), companion: None, is_mutual: false, parameters }
}

fn actuator(name: &'static str, parameters: &'static [f64]) -> Declared<'static> {
    Declared { name, site: Site::Actuator, companion: None, is_mutual: false, parameters }
}

#[test]
fn two_dry_frictions_resist_up_to_the_sum_of_their_levels() {
    let (pendulum, none) = (body("pendulum"), constant(0.0));
    let command = Command { value: &none, before: 0.0, knots: &[] };
    let load = 4.0 * math::sin(0.4);
    let angle = |rise: &'static [f64]| {
        let effects = [joint("coulomb-friction", &[1.0]), joint("stiction", rise)];
        simulate(pendulum, &effects, &command, &times(1.0), 1e-3).last().unwrap()[0]
    };
    assert!(1.0 + 0.4 * 1.4 > load && 1.0 + 0.4 * 1.3 < load);
    assert_eq!(angle(&[0.4, 0.4]), 0.4);
    assert!(angle(&[0.4, 0.3]) < 0.39);
}

#[test]
fn half_swings_with_dry_friction_are_harmonic_about_two_centres() {
    // x'' = -x - 5 (x - y) + u - c sgn(v) is not harmonic; with a clamped second mass and u = 1 it is.
    let (masses, one) = (body("masses"), constant(1.0));
    let command = Command { value: &one, before: 1.0, knots: &[] };
    let clamped = Declared {
        name: "coulomb-friction",
        site: Site::Joint(1),
        companion: None,
        is_mutual: false,
        parameters: &[100.0],
    };
    let drag = Declared {
        name: "viscous-friction",
        site: Site::Joint(0),
        companion: None,
        is_mutual: false,
        parameters: &[-0.2],
    };
    let effects = [joint("coulomb-friction", &[0.3]), clamped, drag];
    let w = 6.0_f64.sqrt();
    for (t, row) in times(3.0).iter().zip(simulate(masses, &effects, &command, &times(3.0), 1e-3)) {
        // Towards the first turn at 2 (u - c)/w^2, then back, about (u + c)/w^2, if the spring exceeds the friction.
        let (first, back) = (0.7 / 6.0, 1.3 / 6.0);
        let half = std::f64::consts::PI / w;
        let x = match *t < half {
            true => first * (1.0 - math::cos(w * t)),
            false if 2.0 * first > back => back + (2.0 * first - back) * math::cos(w * (t - half)),
            false => 2.0 * first,
        };
        let rests = 2.0 * half;
        let x = if *t > rests { back - (2.0 * first - back) } else { x };
        assert!((row[0] - x).abs() < 1e-9, "{} at {t}, not {x}", row[0]);
    }
}

#[test]
fn a_delay_acts_before_effects_that_are_declared_before_it() {
    let heater = body("heater");
    let step = |t: f64| if t < 0.5 { 0.0 } else { 1.0 };
    let late = |t: f64| if t < 0.8 { 0.0 } else { 1.0 };
    let gain = actuator("input-gain-drift", &[0.5]);
    let command = Command { value: &step, before: 0.0, knots: &[0.5] };
    let delayed = simulate(heater, &[gain, actuator("input-delay", &[0.3])], &command, &times(2.0), 1e-3);
    let command = Command { value: &late, before: 0.0, knots: &[0.8] };
    let direct = simulate(heater, &[gain], &command, &times(2.0), 1e-3);
    for (a, b) in delayed.iter().zip(&direct) {
        assert!((a[0] - b[0]).abs() < 1e-12);
    }
}

#[test]
fn the_output_of_a_play_lags_behind_by_half_the_gap() {
    let heater = body("heater");
    let sine = |t: f64| math::sin(t);
    let command = Command { value: &sine, before: 0.0, knots: &[] };
    let play =
        Declared { name: "backlash", site: Site::Sensor(2), companion: None, is_mutual: false, parameters: &[0.4] };
    for (t, row) in times(4.0).iter().zip(simulate(heater, &[play], &command, &times(4.0), 1e-4)) {
        let rising = (math::sin(*t) - 0.2).max(0.0);
        let y = if *t < std::f64::consts::FRAC_PI_2 { rising } else { (math::sin(*t) + 0.2).min(0.8) };
        assert!((row[2] - y).abs() < 1e-8, "{} at {t}, not {y}", row[2]);
    }
}

#[test]
fn half_the_step_changes_signals_by_less_than_a_millionth() {
    let step = |t: f64| if t < 0.413 { 0.2 } else { 1.0 };
    let command = Command { value: &step, before: 0.2, knots: &[0.413] };
    let effects = [
        joint("stribeck-friction", &[0.1, 0.4, 0.1]),
        joint("end-stop", &[30.0, -0.1, 0.2, 0.1]),
        actuator("input-rate-limit", &[0.7]),
    ];
    let run = |longest: f64| simulate(body("masses"), &effects, &command, &times(3.0), longest);
    for (a, b) in run(2.5e-4).iter().flatten().zip(run(1.25e-4).iter().flatten()) {
        assert!((a - b).abs() < 1e-6, "{a} and {b}");
    }
}
