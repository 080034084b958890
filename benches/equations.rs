//! Model given by equations compared with the compiled model: a Furuta pendulum with the same parameters, over 3 s.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use criterion::Criterion;
use mops::{
    Case, Input, Model,
    core::Job,
    models::{
        equations::{Equations, EquationsOptions},
        furuta::Furuta,
        kernel::{Simulated, Tolerance},
    },
};

const END: f64 = 3.0;
/// Parameters `a`, `b`, `c`, `d`, `ba`, `bp`.
const PARAMETERS: [f64; 6] = [0.0044, 0.0075, 0.0036, 0.21, 9e-4, 2e-4];
/// Implicit equations, with derivatives on both sides.
const IMPLICIT: &str = include_str!("../models/tests/equations/furuta-free.toml");
/// Equations with forces and a mass matrix.
const MASS: &str = include_str!("../models/tests/equations/furuta-driven.toml");

/// Model with its parameters.
struct Variant {
    name: &'static str,
    model: Box<dyn Model>,
    parameters: Vec<f64>,
}

fn variants() -> Vec<Variant> {
    let tolerance = Tolerance { relative: 1e-6, absolute: Some(1e-8), ..Tolerance::default() };
    let text = |text: &str| {
        let options = format!("{text}\n[tolerance]\nrelative = 1e-6\nabsolute = 1e-8\n");
        let options: EquationsOptions = toml::from_str(&options).expect("the options are valid");
        Box::new(Simulated::new(Equations::new(&options).expect("the equations are valid")))
    };
    let [a, b, c, d, ba, bp] = PARAMETERS;
    // Initial state: the pendulum at 2 rad, the arm at 0.3 rad.
    vec![
        Variant {
            name: "compiled",
            model: Box::new(Furuta::model(None, tolerance)),
            parameters: vec![a, b, c, d, ba, bp, 0.0, 0.0, 0.3, 0.0, 2.0, 0.0],
        },
        Variant { name: "equations", model: text(IMPLICIT), parameters: vec![b, c, d, bp, ba, 2.0, 0.0, 0.3, 0.0] },
        Variant {
            name: "forces and mass matrix",
            model: text(MASS),
            parameters: vec![a, b, c, d, bp, ba, 2.0, 0.0, 0.3, 0.0],
        },
    ]
}

fn simulate(variant: &Variant, case: &Case) -> f64 {
    let angle = variant.model.interface().signals.iter().position(|s| ["theta", "th"].contains(&s.name.as_str()));
    let signals = [angle.expect("the model has the angle of the pendulum")];
    let job = Job { case, parameters: black_box(&variant.parameters), signals: &signals, horizon: END };
    let analysis = variant.model.analyse(&job).expect("the simulation succeeds");
    let (_, trace) = &analysis.response().expect("a simulation").traces[0];
    trace.last()
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let variants = variants();
    let torque = Input::Sine { amplitude: 0.05, frequency: 4.0 / TAU, phase: 0.0, offset: 0.0 };
    let cases = [
        ("driven by a sine", Case { inputs: vec![("u".into(), torque)], ..Case::default() }),
        ("free", Case::default()),
    ];
    for (what, case) in &cases {
        let ends: Vec<f64> = variants.iter().map(|variant| simulate(variant, case)).collect();
        assert!(ends.iter().all(|end| (end - ends[0]).abs() < 1e-4), "{ends:?}");
        let mut group = criterion.benchmark_group(format!("furuta 3 s, rtol 1e-6, {what}"));
        for variant in &variants {
            group.bench_function(variant.name, |b| b.iter(|| simulate(variant, case)));
        }
        group.finish();
    }
    criterion.final_summary();
    for (what, case) in &cases {
        print_ratios(what, &variants, case);
    }
}

/// Prints medians over rounds of all variants in turn, so that other load of the machine affects all variants equally.
fn print_ratios(what: &str, variants: &[Variant], case: &Case) {
    const ROUNDS: usize = 101;
    const RUNS: u32 = 20;
    let mut rounds: Vec<Vec<f64>> = Vec::new();
    for _ in 0..ROUNDS {
        let time = |variant: &Variant| {
            let start = Instant::now();
            for _ in 0..RUNS {
                black_box(simulate(variant, case));
            }
            start.elapsed().as_secs_f64() / f64::from(RUNS) * 1e6
        };
        rounds.push(variants.iter().map(time).collect());
    }
    let median = |mut numbers: Vec<f64>| {
        numbers.sort_by(f64::total_cmp);
        numbers[numbers.len() / 2]
    };
    for (i, variant) in variants.iter().enumerate() {
        let time = median(rounds.iter().map(|round| round[i]).collect());
        let ratio = median(rounds.iter().map(|round| round[i] / round[0]).collect());
        println!("{what:18} {:24} {time:7.2} us  ratio to compiled {ratio:.2}", variant.name);
    }
}
