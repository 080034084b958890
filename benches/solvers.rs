//! Own time of the solvers: at most 500 evaluations of a problem that costs next to nothing.
//!
//! The problem is the maximum of two ellipsoids; the solvers for fronts minimise both. The time contains the engine: cache,
//! archive, comparison of merits.

use criterion::{BenchmarkId, Criterion, Throughput};
use mops::Usage;
use mops::core::{Budget, Evaluation, Evaluator, Objective, Run, Shape, Solver, SolverOptions};
use mops::solvers::auto::AutoOptions;
use mops::solvers::cma_es::CmaEsOptions;
use mops::solvers::differential_evolution::DifferentialEvolutionOptions;
use mops::solvers::genetic::GeneticOptions;
use mops::solvers::nsga2::Nsga2Options;
use mops::solvers::nsga3::Nsga3Options;
use mops::solvers::pattern_search::PatternSearchOptions;
use mops::solvers::sqp::SqpOptions;
use mops_core::math;

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

/// Two ellipsoids of different centres.
struct Ellipsoids(Shape);

impl Ellipsoids {
    fn new(tuners: usize, objective: Objective) -> Self {
        let rows = vec![(Usage::Minimise, 1.0); 2];
        Self(Shape { spacing: vec![0.0; tuners], rows, objective, ..Shape::default() })
    }
}

impl Evaluator for Ellipsoids {
    fn shape(&self) -> &Shape {
        &self.0
    }

    #[allow(clippy::cast_precision_loss)]
    fn evaluate(&self, point: &[f64]) -> Evaluation {
        let ellipsoid = |centre: f64| {
            let terms = point.iter().enumerate().map(|(i, u)| (1.0 + i as f64) * math::powi(u - centre, 2));
            terms.sum::<f64>() + 1.0
        };
        let scaled = vec![ellipsoid(0.3), ellipsoid(0.6)];
        Evaluation {
            point: point.to_vec(),
            tuners: point.to_vec(),
            readings: Vec::new(),
            merit: self.0.merit(&scaled),
            scaled: Some(scaled),
            residuals: Vec::new(),
            failures: Vec::new(),
        }
    }

    fn tuners_at(&self, point: &[f64]) -> Vec<f64> {
        point.to_vec()
    }

    fn seed(&self) -> u64 {
        1
    }
}

/// Returns the number of evaluations of a run.
fn solve(problem: &Ellipsoids, solver: &mut dyn Solver) -> usize {
    let mut run = Run::new(problem, Budget { evaluations: EVALUATIONS }, &());
    run.solve(solver, &vec![0.9; problem.0.spacing.len()]);
    run.archive().len()
}

fn main() {
    let mut criterion = Criterion::default().sample_size(10).configure_from_args();
    for (name, solvers, objective) in
        [("one objective", &ONE[..], Objective::Max), ("front", &FRONT[..], Objective::Each)]
    {
        let mut group = criterion.benchmark_group(name);
        for tuners in TUNERS {
            let problem = Ellipsoids::new(tuners, objective);
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
