//! Stiff model with 100 states: a rod that is heated at one end, insulated at the other, and radiates.

use std::hint::black_box;

use criterion::Criterion;
use mops::{
    Case, Model, Scalar,
    core::Job,
    models::{
        equations::{Equations, EquationsOptions},
        kernel::{Driven, IntegrationMethod, Simulated, Tolerance, integrate},
    },
};
use mops_core::{Instant, Plant, plant::Jacobian};
use mops_math as math;

const CELLS: usize = 100;
/// Heat exchange between neighbouring cells, 1/s.
const EXCHANGE: f64 = 1000.0;
/// Radiation coefficient, 1/(K3 s).
const RADIATION: f64 = 1e-10;
/// Temperature of the heated end, K.
const HOT: f64 = 400.0;
/// Temperature of the surroundings, K.
const COLD: f64 = 300.0;
const END: f64 = 10.0;

/// Heat equation `T[i]' = EXCHANGE (T[i - 1] - 2 T[i] + T[i + 1]) - RADIATION (T[i]^4 - COLD^4)`.
struct Rod;

impl<S: Scalar> Plant<S> for Rod {
    fn start(&self) -> Vec<S> {
        vec![S::from(COLD); CELLS]
    }

    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        let x = at.x;
        for i in 0..CELLS {
            let left = if i > 0 { x[i - 1] } else { S::from(HOT) };
            let right = if i + 1 < CELLS { x[i + 1] } else { x[i] };
            let square = x[i] * x[i];
            dx[i] = (left - x[i] * 2.0 + right) * EXCHANGE - (square * square - math::powi(COLD, 4)) * RADIATION;
        }
    }

    fn jacobian(&self) -> Option<&dyn Jacobian<S>> {
        Some(self)
    }
}

impl<S: Scalar> Jacobian<S> for Rod {
    fn pattern(&self) -> Vec<(usize, usize)> {
        let neighbours = |i: usize| (i.saturating_sub(1)..=(i + 1).min(CELLS - 1)).map(move |j| (i, j));
        (0..CELLS).flat_map(neighbours).collect()
    }
}

/// Heat equation as in a study file.
const TEXT: &str = r#"
horizon = 10.0
states  = { "T[1..100]" = "K" }
start   = { "T[i]" = 300.0 }

[let]
"flow[i=1..99]" = "1000*(T[i] - T[i+1])"

[der]
"T[i]"   = "flow[i-1] - flow[i] - 1e-10*(T[i]^4 - 300^4)"
"T[1]"   = "1000*(400 - T[1]) - flow[1] - 1e-10*(T[1]^4 - 300^4)"
"T[100]" = "flow[99] - 1e-10*(T[100]^4 - 300^4)"

[tolerance]
method   = "stiff"
relative = 1e-6
absolute = 1e-6
"#;

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let tolerance =
        Tolerance { relative: 1e-6, absolute: Some(1e-6), method: IntegrationMethod::Stiff, ..Tolerance::default() };
    let compiled = || {
        integrate(&mut Driven::alone(Rod), 0.0, END, black_box(&[COLD; CELLS]), &tolerance, &mut ())
            .expect("the simulation succeeds")
    };
    let (end, work) = compiled();
    println!("compiled: {work:?}, end {:.9}, {:.9}, {:.9}", end[0], end[CELLS / 2], end[CELLS - 1]);

    let options: EquationsOptions = toml::from_str(TEXT).expect("the options are valid");
    let model = Simulated::new(Equations::new(&options).expect("the equations are valid"));
    let case = Case::default();
    // An initial value given by an expression is a parameter without a default.
    let parameters: Vec<f64> = model.interface().parameters.iter().map(|p| p.default.unwrap_or(f64::NAN)).collect();
    let signals = [0, CELLS / 2, CELLS - 1];
    let job = Job { case: &case, parameters: &parameters, signals: &signals, horizon: END };
    let equations = || model.analyse(black_box(&job)).expect("the simulation succeeds");
    let analysis = equations();
    let response = analysis.response().expect("a simulation");
    let ends: Vec<f64> = response.traces.iter().map(|(_, trace)| trace.last()).collect();
    println!("equations: {:?}, end {:.9}, {:.9}, {:.9}", response.work, ends[0], ends[1], ends[2]);

    let mut group = criterion.benchmark_group("heat rod, 100 states, rtol 1e-6");
    group.bench_function("compiled", |b| b.iter(compiled));
    group.bench_function("equations", |b| b.iter(equations));
    group.finish();
    criterion.final_summary();
}
