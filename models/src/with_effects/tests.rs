//! Models with effects, against closed forms.

use std::sync::Arc;

use mops_core::{Case, Hold, Input, Job, Model, ModelOptions, Placement, Port};

use super::WithEffects;
use crate::effects::effects;
use crate::equations::EquationsOptions;

fn equations(text: &str) -> Arc<dyn Model> {
    let options: EquationsOptions = toml::from_str(text).expect("it is TOML");
    Arc::from(options.build().expect("it is a model"))
}

fn with(model: &Arc<dyn Model>, list: &[(&str, &str)]) -> WithEffects {
    let port = |place: &str| -> Port {
        model.interface().ports.iter().find(|p| p.to_string() == place).expect("the port is there").clone()
    };
    let place = |(i, (name, place)): (usize, &(&str, &str))| Placement {
        name: format!("e{i}"),
        effect: effects().into_iter().find(|e| e.name() == *name).expect("it is in the catalogue"),
        port: port(place),
        companion: None,
    };
    WithEffects::new(Arc::clone(model), list.iter().enumerate().map(place).collect()).expect("it fits")
}

const BLOCK: &str = r#"
states     = { x = "m", v = "m/s" }
inputs     = { u = "N" }
parameters = { m = "kg" }
der        = { x = "v", v = "m*v' = u" }
"#;

/// Values of `x` and `v` at the end.
fn run(model: &dyn Model, parameters: &[f64], inputs: Vec<(String, Input)>, end: f64) -> [f64; 2] {
    let case = Case { inputs, ..Case::default() };
    let job = Job { case: &case, parameters, signals: &[0, 1], horizon: end };
    let analysis = model.analyse(&job).expect("it simulates");
    ["x", "v"].map(|signal| analysis.trace(signal).last())
}

#[test]
fn a_block_with_dry_friction_stops_where_its_energy_is_used_up() {
    let model = with(&equations(BLOCK), &[("coulomb-friction", "joint:x")]);
    // m = 2, x0 = 0, v0 = 3, c = 4: stops after m v0/c = 1.5 s at m v0^2/(2 c) = 2.25 m, and stays.
    let end = run(&model, &[2.0, 0.0, 3.0, 4.0], Vec::new(), 5.0);
    assert!((end[0] - 2.25).abs() < 1e-8 && end[1] == 0.0, "{end:?}");
    let early = run(&model, &[2.0, 0.0, 3.0, 4.0], Vec::new(), 1.0);
    assert!((early[1] - 1.0).abs() < 1e-8 && (early[0] - 2.0).abs() < 1e-8, "{early:?}");
}

#[test]
fn a_force_below_the_limit_moves_nothing_and_one_above_it_moves_with_the_difference() {
    let model = with(&equations(BLOCK), &[("coulomb-friction", "joint:x")]);
    let push = |force: f64| vec![("u".to_owned(), Input::Constant(force))];
    assert_eq!(run(&model, &[2.0, 1.0, 0.0, 4.0], push(3.9), 5.0), [1.0, 0.0]);
    let end = run(&model, &[2.0, 1.0, 0.0, 4.0], push(5.0), 2.0);
    assert!((end[1] - 1.0).abs() < 1e-9 && (end[0] - 2.0).abs() < 1e-9, "{end:?}");
}

#[test]
fn an_equation_written_the_other_way_round_has_the_same_friction() {
    let turned = BLOCK.replace("m*v' = u", "u = m*v'");
    let model = with(&equations(&turned), &[("coulomb-friction", "joint:x"), ("viscous-friction", "joint:x")]);
    let end = run(&model, &[2.0, 0.0, 3.0, 4.0, 0.0], Vec::new(), 5.0);
    assert!((end[0] - 2.25).abs() < 1e-8 && end[1] == 0.0, "{end:?}");
    let end = run(&model, &[2.0, 0.0, 3.0, 0.0, 1.0], Vec::new(), 2.0);
    assert!((end[1] - 3.0 * (-1.0_f64).exp()).abs() < 1e-8, "{end:?}");
}

#[test]
fn neutral_effects_change_no_bit() {
    let plain = equations(BLOCK);
    let model = with(&plain, &[("coulomb-friction", "joint:x"), ("viscous-friction", "joint:x")]);
    let times: Vec<f64> = (0..50).map(|k| f64::from(k) * 0.1).collect();
    let values = times.iter().map(|t| (3.0 * t).sin()).collect();
    let inputs = vec![("u".to_owned(), Input::Sampled { times, values, hold: Hold::Zero })];
    let a = run(plain.as_ref(), &[2.0, 0.3, 0.7], inputs.clone(), 4.9);
    let b = run(&model, &[2.0, 0.3, 0.7, 0.0, 0.0], inputs, 4.9);
    assert_eq!(a.map(f64::to_bits), b.map(f64::to_bits));
}

#[test]
fn tangents_along_strengths_are_those_of_differences() {
    let model = with(&equations(BLOCK), &[("coulomb-friction", "joint:x"), ("viscous-friction", "joint:x")]);
    let inputs = vec![("u".to_owned(), Input::Sine { amplitude: 6.0, frequency: 0.4, phase: 0.3, offset: 0.5 })];
    let case = Case { inputs, ..Case::default() };
    let parameters = [2.0, 0.0, 3.0, 2.5, 0.8];
    let job = Job { case: &case, parameters: &parameters, signals: &[0, 1], horizon: 4.0 };
    let seeds: Vec<Vec<f64>> = (0..5).map(|i| (0..5).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    let (_, tangents) = model.tangents(&job, &seeds).expect("it has them").expect("it simulates");
    for (i, tangent) in tangents.iter().enumerate() {
        let moved = |by: f64| {
            let mut p = parameters;
            p[i] += by;
            run(&model, &p, case.inputs.clone(), 4.0)
        };
        let (up, down) = (moved(1e-5), moved(-1e-5));
        for (k, signal) in ["x", "v"].into_iter().enumerate() {
            let (exact, difference) = (tangent.trace(signal).last(), (up[k] - down[k]) / 2e-5);
            assert!((exact - difference).abs() < 1e-4 * (1.0 + difference.abs()), "{i} {signal} {exact} {difference}");
        }
    }
}
