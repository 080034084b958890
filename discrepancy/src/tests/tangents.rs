//! A candidate is screened by its tangent: a secant sees the curvature of what the unknowns absorb.

use std::sync::Arc;

use mops_core::{Hold, Input, Job, Model, Trials};
use mops_models::effects::effects;

use crate::candidate::candidates;
use crate::fit::dot;
use crate::meter::Meter;
use crate::testing::{Record, fitted, subject};
use crate::trace_of::{View, sizes};
use crate::variant::{Added, Variant};

const PLANT: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", d = "N s/m", k = "N/m" }
der        = { x = "v", v = "m*v' = u - d*v - k*x - 3*k*x^3" }
"#;
const TRUTH: [f64; 5] = [2.0, 0.8, 8.0, 0.3, -0.2];
const COUNT: u32 = 300;

fn record() -> Record {
    let times: Vec<f64> = (0..COUNT).map(|k| f64::from(k) * 0.02).collect();
    let values = times.iter().map(|t| 6.0 * (3.0 * t).sin()).collect();
    let input = Input::Sampled { times: times.clone(), values, hold: Hold::First };
    let signals = ["x", "v"].map(|name| (name, vec![0.0; COUNT as usize], 0.5)).to_vec();
    Record { inputs: vec![("u", input)], times, signals }
}

#[test]
fn every_effect_that_is_linear_in_its_strength_is_screened_by_the_tangent_of_the_simulation() {
    let subject = subject(PLANT, &TRUTH, 2, vec![record()]);
    let simulations = Meter::new(&());
    let (fit, variant, mut at, mut scene) = fitted(&subject, &simulations);
    at.point.globals = TRUTH[..3].to_vec();
    at.point.locals = vec![TRUTH[3..].to_vec()];
    scene.trajectories = vec![crate::trajectory::Trajectory::new(&fit, &variant.model, 0, &at.point).expect("it runs")];
    let piece = &fit.pieces[0];
    let measured = ["x", "v"].map(str::to_owned);
    let mut compared = Vec::new();
    for candidate in candidates(&effects(), subject.model.interface(), &measured, &[0]) {
        let effect = Arc::clone(&candidate.effect);
        let first = &effect.strengths()[0];
        if first.trials != Trials::Linear || first.neutral != Some(0.0) {
            continue;
        }
        let Some(sizes) = sizes(&candidate.port, &variant.model, &fit.pieces, &scene.trajectories) else { continue };
        let Some(strengths) = sizes.combinations(effect.as_ref()).into_iter().next() else { continue };
        let view = View::new(&candidate, &variant.model, piece, &scene.trajectories[0]);
        let Some(screened) = view.and_then(|view| view.trace(&strengths)) else { continue };
        let own = Vec::new();
        let with = Variant::new(
            &subject,
            &[Added {
                candidate: candidate.clone(),
                strengths: strengths.clone(),
                own,
                starts: Vec::new(),
                sizes,
                expected: None,
            }],
            &fit.pieces,
        );
        let mut parameters = TRUTH.to_vec();
        parameters.extend(&strengths);
        parameters[TRUTH.len()] = 0.0;
        parameters.resize(with.model.interface().parameters.len(), 0.0);
        let mut seed = vec![0.0; parameters.len()];
        seed[TRUTH.len()] = strengths[0];
        let job = Job { case: &piece.case, parameters: &parameters, signals: &[0, 1], horizon: piece.horizon };
        let (_, tangents) = with.model.tangents(&job, &[seed]).expect("exact").expect("it runs");
        let exact: Vec<f64> = piece
            .series
            .iter()
            .flat_map(|s| tangents[0].trace(&s.name).sample(&s.times).into_iter().map(|y| y / s.noise))
            .collect();
        if exact.iter().all(|&y| y == 0.0) {
            // Stiction changes nothing in a motion that never rests.
            assert!(screened.iter().all(|&y| y == 0.0), "{} at {}", effect.name(), candidate.place());
            continue;
        }
        let off: Vec<f64> = screened.iter().zip(&exact).map(|(a, b)| a - b).collect();
        let error = (dot(&off, &off) / dot(&exact, &exact)).sqrt();
        compared.push((format!("{} at {}", effect.name(), candidate.place()), error));
    }
    let wrong: Vec<_> = compared.iter().filter(|c| c.1.is_nan() || c.1 >= 0.01).collect();
    assert!(compared.len() > 20, "{compared:?}");
    assert!(wrong.is_empty(), "{wrong:?} of {}", compared.len());
}
