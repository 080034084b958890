//! The best of many candidates gains by chance alone: noise shows how much, as the unknowns leave it.

use std::sync::atomic::AtomicUsize;

use mops_models::effects::effects;

use crate::candidate::{Candidate, candidates};
use crate::screen::{Screening, screen};
use crate::subject::Subject;
use crate::testing::{Record, fitted, subject, white};
use crate::weigh::by_chance;

/// An oscillator whose stiffness, damping and start absorb most of what moves it near its frequency.
const OSCILLATOR: &str = r#"
states     = { x = "m", v = "m/s" }
parameters = { d = "1/s", k = "1/s^2" }
der        = { x = "v", v = "v' = -d*v - k*x" }
"#;
const NOISE: f64 = 0.01;
const SAMPLES: u32 = 80;

/// Two records of `x'' + d x' + k x = 0`.
fn records() -> Vec<Record> {
    let record = |amplitude: f64| {
        let times: Vec<f64> = (0..SAMPLES).map(|i| 0.04 * f64::from(i)).collect();
        let swing = |t: &f64| amplitude * (-0.05 * t).exp() * (4.0 * t).cos();
        let noise = white(&amplitude.to_string(), NOISE, times.len());
        let values = times.iter().zip(noise).map(|(t, e)| swing(t) + e).collect();
        Record { inputs: Vec::new(), times, signals: vec![("x", values, NOISE)] }
    };
    vec![record(1.0), record(0.6)]
}

fn draws(count: usize, length: usize) -> Vec<Vec<f64>> {
    (0..count).map(|k| white(&format!("draw {k}"), 1.0, length)).collect()
}

fn oscillator() -> Subject {
    subject(OSCILLATOR, &[0.1, 16.0, 1.0, 0.0], 2, records())
}

fn all(subject: &Subject) -> Vec<Candidate> {
    candidates(&effects(), subject.model.interface(), &["x".to_owned()], &[0, 1])
}

#[test]
fn noise_gains_as_much_as_what_a_fit_leaves_of_it() {
    let (subject, simulations) = (oscillator(), AtomicUsize::new(0));
    let (fit, variant, _, mut scene) = fitted(&subject, &simulations);
    let draws = draws(20, scene.residuals.len());
    let screening = screen(&all(&subject), &fit, &variant.model, &scene, &draws);
    for (draw, by_noise) in draws.iter().zip(&screening.by_chance) {
        scene.residuals = scene.project(draw);
        let gain = screen(&all(&subject), &fit, &variant.model, &scene, &[]).screened[0].gain;
        assert!((gain - by_noise).abs() < 1e-9 * gain, "{gain} {by_noise}");
    }
}

#[test]
fn the_probability_of_what_noise_gains_is_uniform() {
    const KNOWN: usize = 40;
    const OTHERS: u32 = 160;
    let (subject, simulations) = (oscillator(), AtomicUsize::new(0));
    let (fit, variant, _, scene) = fitted(&subject, &simulations);
    let draws = draws(KNOWN + OTHERS as usize, scene.residuals.len());
    let screening = screen(&all(&subject), &fit, &variant.model, &scene, &draws);
    let (known, others) = screening.by_chance.split_at(KNOWN);
    let known = Screening { screened: Vec::new(), by_chance: known.to_vec() };
    let directions = known.independent().expect("there are draws");
    let mut chances: Vec<f64> = others.iter().map(|&gain| by_chance(gain, directions)).collect();
    chances.sort_by(f64::total_cmp);
    let ideal = |k: u32| (f64::from(k) + 0.5) / f64::from(OTHERS);
    let apart = chances.iter().zip(0..).map(|(p, k)| (p - ideal(k)).abs()).fold(0.0, f64::max);
    // Of uniform ones one set in a hundred is further apart: Kolmogorov's 1.63, and what 40 draws leave open of the law.
    let allowed = 1.63 / f64::from(OTHERS).sqrt() + 1.0 / (std::f64::consts::E * (KNOWN as f64).sqrt());
    assert!(apart < allowed, "{apart} {allowed}");
}
