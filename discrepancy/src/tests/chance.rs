//! The best of many candidates gains by chance alone: noise shows how much, as the unknowns leave it.

use mops_effects::effects;

use crate::candidate::{Candidate, candidates};
use crate::meter::Meter;
use crate::screen::{Screening, screen};
use crate::search::{Limits, Search};
use crate::subject::Subject;
use crate::testing::{Record, fitted, subject, white};
use crate::weigh::{Dispersion, by_chance, criterion};
use mops_core::math;

/// An oscillator whose stiffness, damping and start absorb most of what moves it near its frequency.
const OSCILLATOR: &str = r#"
states     = { x = "m", v = "m/s" }
parameters = { d = "1/s", k = "1/s^2" }
der        = { x = "v", v = "v' = -d*v - k*x" }
"#;
const NOISE: f64 = 0.01;
const SAMPLES: u32 = 80;
const STEP: f64 = 0.04;

/// Two records of `x'' + d x' + k x = 0`.
fn records() -> Vec<Record> {
    let record = |amplitude: f64| {
        let swing = |t: f64| [amplitude * math::exp(-0.05 * t) * math::cos(4.0 * t), 0.0];
        let states: Vec<[f64; 2]> = (0..SAMPLES).map(|i| swing(STEP * f64::from(i))).collect();
        Record::of_first("x", &states, STEP, NOISE, &amplitude.to_string())
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
    let (subject, simulations) = (oscillator(), Meter::new(&()));
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
fn a_phase_of_every_experiment_is_paid_for_with_its_samples() {
    let (subject, simulations, effects) = (oscillator(), Meter::new(&()), effects());
    let (fit, variant, _, scene) = fitted(&subject, &simulations);
    let screened = screen(&all(&subject), &fit, &variant.model, &scene, &[]).screened;
    let periodic = screened.iter().find(|s| s.added.candidate.effect.name() == "periodic-disturbance");
    let added = periodic.expect("it can act there").added.clone();
    let search = Search::new(&subject, &effects, Limits::at(0.01), &simulations);
    let trial = search.trial(&[added], &subject.start(), vec![vec![1.0, 0.0]; 2], 1, 1).expect("it simulates");
    let rarity = f64::from(trial.added[0].candidate.effect.rarity());
    // Amplitude and frequency in two records of 80 samples together, a phase in each.
    let paid = 2.0 * math::ln(160.0) + 2.0 * math::ln(80.0) + 2.0 * rarity;
    let told = criterion(&trial, &Dispersion::WHITE) - trial.fitted.chi2;
    assert!((told - paid).abs() < 1e-6 * trial.fitted.chi2, "{told} {paid}");
}

#[test]
fn the_probability_of_what_noise_gains_is_uniform() {
    const KNOWN: usize = 40;
    const OTHERS: u32 = 160;
    let (subject, simulations) = (oscillator(), Meter::new(&()));
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
