//! A candidate is screened by its tangent: a secant sees the curvature of what the unknowns absorb.

use std::sync::Arc;

use mops_core::{Input, Job, Model, case::Hold, effect::InitialGrid};
use mops_effects::effects;
use mops_math as math;

use crate::candidates::candidates;
use crate::fit::pieces::pieces;
use crate::fit::{Added, Meter, Variant, cut, dot, problem};
use crate::motion::{View, sizes};
use crate::settings::Coverage;
use crate::testing::{Record, subject};

const PLANT: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg", d = "N s/m", k = "N/m" }
der        = { x = "v", v = "m*v' = u - d*v - k*x - 3 [1/m2]*k*x^3" }
"#;
const TRUTH: [f64; 5] = [2.0, 0.8, 8.0, 0.3, -0.2];
const COUNT: u32 = 300;

fn record() -> Record {
    let times: Vec<f64> = (0..COUNT).map(|k| f64::from(k) * 0.02).collect();
    let values = times.iter().map(|t| 6.0 * math::sin(3.0 * t)).collect();
    let input = Input::Sampled { times: times.clone(), values, hold: Hold::First };
    let signals = ["x", "v"].map(|name| (name, vec![0.0; COUNT as usize], 0.5)).to_vec();
    Record { inputs: vec![("u", input)], times, signals }
}

#[test]
fn every_effect_that_is_linear_in_its_strength_is_screened_by_the_tangent_of_the_simulation() {
    let subject = subject(PLANT, &TRUTH, 2, vec![record()]);
    let simulations = Meter::new(&());
    let own = pieces(&subject, |_| true);
    let locals = vec![TRUTH[3..].to_vec()];
    let (fit, at, variant) = problem(&subject, &[], own, &TRUTH[..3], locals, &[], &simulations);
    let trajectories = vec![crate::motion::Trajectory::new(&fit, &variant.model, 0, &at).expect("it runs")];
    let piece = &fit.pieces[0];
    let mut compared = Vec::new();
    for candidate in candidates(&subject, &effects()) {
        let effect = Arc::clone(&candidate.effect);
        let first = &effect.parameters()[0];
        if first.grid != InitialGrid::Linear || first.null_value != Some(0.0) {
            continue;
        }
        let Some(sizes) = sizes(&candidate.port, &variant.model, &fit.pieces, &trajectories, Coverage::DEFAULT) else {
            continue;
        };
        let Some(strengths) = sizes.combinations(effect.as_ref()).into_iter().next() else { continue };
        let view = View::new(&candidate, &variant.model, piece, &trajectories[0]);
        let Some(screened) = view.and_then(|view| view.trace(&strengths)) else { continue };
        let own = Vec::new();
        let with = Variant::new(
            &subject,
            &[Added { candidate: candidate.clone(), strengths: strengths.clone(), own, starts: Vec::new(), sizes }],
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

/// In a plant that is linear in its input the change that is screened is that of the simulation, whatever its size.
#[test]
fn in_a_window_an_actuator_is_screened_with_what_was_commanded_before() {
    let subject = subject(&PLANT.replace(" - 3 [1/m2]*k*x^3", ""), &TRUTH, 2, vec![record()]);
    let simulations = Meter::new(&());
    let own = pieces(&subject, |_| true);
    let locals = vec![TRUTH[3..].to_vec()];
    let (mut fit, mut at, variant) = problem(&subject, &[], own, &TRUTH[..3], locals, &[], &simulations);
    fit.pieces = cut(0, &subject.measurements[0], subject.model.as_ref(), 4);
    at.globals = TRUTH[..3].to_vec();
    at.locals = vec![TRUTH[3..].to_vec(); 4];
    let piece = &fit.pieces[2];
    assert_eq!(piece.case.begins, 3.0 - 0.01);
    let Some((_, Input::Sampled { times, .. })) = piece.case.inputs.first() else { panic!("{:?}", piece.case.inputs) };
    assert!(
        times[0] == -piece.case.begins && times.len() == COUNT as usize,
        "{} samples from {}",
        times.len(),
        times[0]
    );
    let trajectory = crate::motion::Trajectory::new(&fit, &variant.model, 2, &at).expect("it runs");
    for (name, strength) in [("input-rate-limit", 6.0), ("backlash", 2.0), ("input-delay", 0.3)] {
        let all = candidates(&subject, &effects());
        let candidate = all.into_iter().find(|c| c.is_named(name, "actuator:u")).expect("it fits");
        let view = View::new(&candidate, &variant.model, piece, &trajectory).expect("it is there");
        let screened = view.trace(&[strength]).expect("it is finite");
        let sizes = sizes(
            &candidate.port,
            &variant.model,
            &fit.pieces[2..3],
            std::slice::from_ref(&trajectory),
            Coverage::DEFAULT,
        );
        let added = Added {
            candidate: candidate.clone(),
            strengths: vec![strength],
            own: Vec::new(),
            starts: Vec::new(),
            sizes: sizes.expect("it moves"),
        };
        let with = Variant::new(&subject, &[added], &fit.pieces[2..3]);
        let simulated = |strength: f64| -> Vec<f64> {
            let mut parameters = [&TRUTH[..], &[strength]].concat();
            parameters.resize(with.model.interface().parameters.len(), 0.0);
            let job = Job { case: &piece.case, parameters: &parameters, signals: &[0, 1], horizon: piece.horizon };
            let run = with.model.analyse(&job).expect("it runs");
            piece
                .series
                .iter()
                .flat_map(|s| run.trace(&s.name).sample(&s.times).into_iter().map(|y| y / s.noise))
                .collect()
        };
        let neutral = candidate.effect.parameters()[0].null_value.expect("it has one");
        let changed = simulated(strength).iter().zip(simulated(neutral)).map(|(a, b)| a - b).collect::<Vec<f64>>();
        let off: Vec<f64> = screened.iter().zip(&changed).map(|(a, b)| a - b).collect();
        let error = (dot(&off, &off) / dot(&changed, &changed)).sqrt();
        assert!(error < 0.02, "{name}: {error}");
    }
}
