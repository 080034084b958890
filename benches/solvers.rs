//! Own time of the solvers: at most 500 evaluations of a problem that costs next to nothing.
//!
//! The problem is the maximum of two ellipsoids; the solvers for fronts minimise both. The time contains the engine:
//! cache, archive, comparison of merits.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput};
use mops::{
    Usage,
    core::{Objective, Run, Shape, Solver, SolverOptions, run::Budget},
    solvers::{
        auto::AutoOptions, cma_es::CmaEsOptions, differential_evolution::DifferentialEvolutionOptions,
        genetic::GeneticOptions, nsga2::Nsga2Options, nsga3::Nsga3Options, pattern_search::PatternSearchOptions,
        sqp::SqpOptions,
    },
};
use mops_math as math;

use common::ClosedForm;

/// Largest number of evaluations of a run.
const EVALUATIONS: usize = 500;

/// Numbers of tuners.
const TUNERS: [usize; 3] = [4, 12, 50];

/// Name and constructor of a solver.
type Named = (&'static str, fn() -> Box<dyn Solver>);

/// Solvers for one objective, and for a front.
const ONE: [Named; 6] = [
    ("auto", || AutoOptions::default().build()),
    ("sqp", || SqpOptions::default().build()),
    ("pattern-search", || PatternSearchOptions::default().build()),
    ("genetic", || GeneticOptions::default().build()),
    ("cma-es", || CmaEsOptions::default().build()),
    ("differential-evolution", || DifferentialEvolutionOptions::default().build()),
];
const FRONT: [Named; 2] =
    [("nsga2", || Nsga2Options::default().build()), ("nsga3", || Nsga3Options::default().build())];

/// Returns the values of two ellipsoids of different centres.
#[allow(clippy::cast_precision_loss)]
fn ellipsoids(point: &[f64]) -> Vec<f64> {
    let ellipsoid = |centre: f64| {
        let terms = point.iter().enumerate().map(|(i, u)| (1.0 + i as f64) * math::powi(u - centre, 2));
        terms.sum::<f64>() + 1.0
    };
    vec![ellipsoid(0.3), ellipsoid(0.6)]
}

/// Returns the number of evaluations of a run.
fn solve(problem: &ClosedForm, solver: &mut dyn Solver) -> usize {
    let mut run = Run::new(problem, Budget { evaluations: EVALUATIONS }, &());
    run.solve(solver, &vec![0.9; problem.shape.spacing.len()]);
    run.archive().len()
}

fn main() {
    let mut criterion = Criterion::default().sample_size(10).configure_from_args();
    for (name, solvers, objective) in
        [("one objective", &ONE[..], Objective::Max), ("front", &FRONT[..], Objective::Each)]
    {
        let mut group = criterion.benchmark_group(name);
        for tuners in TUNERS {
            let rows = vec![(Usage::Minimise, 1.0); 2];
            let shape = Shape { spacing: vec![0.0; tuners], rows, objective, ..Shape::default() };
            let problem = ClosedForm { shape, scaled: ellipsoids };
            for (solver, build) in solvers {
                group.throughput(Throughput::Elements(solve(&problem, build().as_mut()) as u64));
                group.bench_function(BenchmarkId::new(*solver, tuners), |b| {
                    b.iter(|| solve(&problem, build().as_mut()));
                });
            }
        }
        group.finish();
    }
    criterion.final_summary();
}
