//! Speed-up by a second thread for evaluations of 0.2 s: generations, polls of pattern search, gradients by
//! differences.
//!
//! An evaluation sleeps instead of computing. The speed-up is then that of the solver and the engine, independent of
//! other load of the machine.

mod common;

use std::thread::sleep;
use std::time::{Duration, Instant};

use mops::{
    Usage,
    core::{Run, Shape, Solver, SolverOptions, run::Budget},
    solvers::{genetic::GeneticOptions, pattern_search::PatternSearchOptions, sqp::SqpOptions},
};
use mops_math as math;

use common::ClosedForm;

/// Duration of an evaluation.
const DURATION: Duration = Duration::from_millis(200);

/// Numbers of tuners and of evaluations. Single points are evaluated between polls and gradients; their share is larger
/// for fewer tuners.
const SIZES: [(usize, usize); 2] = [(6, 80), (20, 160)];

/// Name and constructor of a solver.
type Named = (&'static str, fn() -> Box<dyn Solver>);

/// Returns the values of two paraboloids after a pause.
fn slow_paraboloids(point: &[f64]) -> Vec<f64> {
    sleep(DURATION);
    let paraboloid = |centre: f64| point.iter().map(|u| math::powi(u - centre, 2)).sum::<f64>() + 1.0;
    vec![paraboloid(0.3), paraboloid(0.6)]
}

/// Returns the time, s, for a number of evaluations on `threads` threads, and the best objective.
fn timed(problem: &ClosedForm, evaluations: usize, solver: &mut dyn Solver, threads: usize) -> (f64, f64) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
    pool.install(|| {
        let start = Instant::now();
        let mut run = Run::new(problem, Budget { evaluations }, &());
        run.solve(solver, &vec![0.9; problem.shape.spacing.len()]);
        let best = run.archive().iter().map(|record| record.merit.objective).fold(f64::INFINITY, f64::min);
        (start.elapsed().as_secs_f64(), best)
    })
}

fn main() {
    let solvers: [Named; 3] = [
        ("genetic", || GeneticOptions::default().build()),
        ("pattern-search", || PatternSearchOptions::default().local()),
        ("sqp, gradients by differences", || SqpOptions::default().local()),
    ];
    for (tuners, evaluations) in SIZES {
        let shape = Shape { spacing: vec![0.0; tuners], rows: vec![(Usage::Minimise, 1.0); 2], ..Shape::default() };
        let problem = ClosedForm { shape, scaled: slow_paraboloids };
        for (name, build) in solvers {
            let [(one, best), (two, same)] =
                [1, 2].map(|threads| timed(&problem, evaluations, build().as_mut(), threads));
            assert_eq!(best.to_bits(), same.to_bits(), "{name}: threads change no bit");
            let ratio = one / two;
            println!("{name:30} {tuners:2} tuners  1 thread {one:6.2} s, 2 threads {two:6.2} s, ratio {ratio:.2}");
        }
    }
}
