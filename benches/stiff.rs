//! A stiff model of a hundred states: a rod that is heated at one end, radiates, and is insulated at the other.

use std::hint::black_box;

use criterion::Criterion;
use mops::Scalar;
use mops::models::kernel::{Dynamics, IntegrationMethod, Tolerance, integrate};

const CELLS: usize = 100;
/// Exchange of heat between neighbouring cells, 1/s.
const EXCHANGE: f64 = 1000.0;
/// Radiation, 1/(K3 s).
const RADIATION: f64 = 1e-10;
/// Temperature of the heated end and of the surroundings, K.
const HOT: f64 = 400.0;
const COLD: f64 = 300.0;
const END: f64 = 10.0;

/// `T[i]' = EXCHANGE (T[i - 1] - 2 T[i] + T[i + 1]) - RADIATION (T[i]^4 - COLD^4)`.
struct Rod;

impl<S: Scalar> Dynamics<S> for Rod {
    type State = Vec<S>;

    fn derivative(&self, _: f64, x: &Vec<S>, dx: &mut Vec<S>) {
        for i in 0..CELLS {
            let left = if i > 0 { x[i - 1] } else { S::from(HOT) };
            let right = if i + 1 < CELLS { x[i + 1] } else { x[i] };
            let square = x[i] * x[i];
            dx[i] = (left - x[i] * 2.0 + right) * EXCHANGE - (square * square - COLD.powi(4)) * RADIATION;
        }
    }

    fn jacobian_pattern(&self) -> Option<Vec<(usize, usize)>> {
        let neighbours = |i: usize| (i.saturating_sub(1)..=(i + 1).min(CELLS - 1)).map(move |j| (i, j));
        Some((0..CELLS).flat_map(neighbours).collect())
    }
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    let tolerance =
        Tolerance { relative: 1e-6, absolute: 1e-6, method: IntegrationMethod::Stiff, ..Tolerance::default() };
    let run = || integrate(&mut Rod, 0.0, END, black_box(vec![COLD; CELLS]), &tolerance, &mut ()).expect("it ends");
    let (end, work) = run();
    println!("{work:?}, end {:.9}, {:.9}, {:.9}", end[0], end[CELLS / 2], end[CELLS - 1]);
    criterion.bench_function("heat rod, 100 states, rtol 1e-6", |b| b.iter(run));
    criterion.final_summary();
}
