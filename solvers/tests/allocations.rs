//! Memory allocations of solvers between evaluations.

use mops_core::{
    Evaluation, Halt, Oracle, Progress, Run, Shape, Solver, SolverOptions, run::Budget, solver::Linearisation,
};
use mops_math::Stream;
use mops_problems::{Posed, Slope, suites};
use mops_solvers::{
    cma_es::CmaEsOptions, differential_evolution::DifferentialEvolutionOptions, genetic::GeneticOptions,
    pattern_search::PatternSearchOptions, sqp::SqpOptions,
};

/// Oracle whose own allocations are not counted.
struct UncountedOracle<'a>(&'a mut dyn Oracle);

impl Oracle for UncountedOracle<'_> {
    fn shape(&self) -> &Shape {
        self.0.shape()
    }

    fn evaluate(&mut self, points: &[Vec<f64>]) -> Result<Vec<Evaluation>, Halt> {
        uncounted(|| self.0.evaluate(points))
    }

    fn linearise(&mut self, point: &[f64], reach: f64) -> Result<Option<Linearisation>, Halt> {
        uncounted(|| self.0.linearise(point, reach))
    }

    fn best(&self) -> Option<&Evaluation> {
        self.0.best()
    }

    fn is_over(&self) -> bool {
        self.0.is_over()
    }

    fn remaining(&self) -> usize {
        self.0.remaining()
    }

    fn stream(&self, label: &str) -> Stream {
        self.0.stream(label)
    }
}

fn uncounted<T>(ask: impl FnOnce() -> T) -> T {
    let mut answer = None;
    allocation_counter::opt_out(|| answer = Some(ask()));
    answer.expect("the closure has run")
}

/// Returns the method of a kind alone, without several starts and without polishing.
fn method(kind: &str) -> Box<dyn Solver> {
    match kind {
        "sqp" => SqpOptions::default().local(),
        "pattern-search" => PatternSearchOptions::default().local(),
        "genetic" => GeneticOptions { polish: false, ..GeneticOptions::default() }.build(),
        "cma-es" => CmaEsOptions { polish: false, ..CmaEsOptions::default() }.build(),
        "differential-evolution" => {
            DifferentialEvolutionOptions { polish: false, ..DifferentialEvolutionOptions::default() }.build()
        }
        _ => {
            let kind = mops_solvers::kinds().into_iter().find(|known| known.name == kind);
            kind.expect("the kind is registered").default_choice().make()
        }
    }
}

/// Returns the number of allocated blocks per evaluation of the budget, for a solver of some kind on a problem of a
/// suite. The first few steps do not count.
fn blocks(kind: &str, suite: &str, name: &str, budget: usize) -> f64 {
    let suite = suites().into_iter().find(|known| known.name == suite).expect("the suite is registered");
    let problems = (suite.problems)();
    let problem = problems.iter().find(|problem| problem.name == name).expect("the problem is in the suite");
    let posed = Posed::new(problem, Slope::Differences);
    let mut run = Run::new(&posed, Budget { evaluations: budget }, &());
    let mut solver = method(kind);
    solver.begin(&mut run, &posed.start()).expect("the budget is larger");
    // Buffers that are allocated once exist by then.
    for _ in 0..3 {
        solver.step(&mut UncountedOracle(&mut run)).expect("the budget is larger");
    }
    let measured =
        allocation_counter::measure(
            || while let Ok(Progress::Continue) = solver.step(&mut UncountedOracle(&mut run)) {},
        );
    #[allow(clippy::cast_precision_loss)]
    {
        measured.count_total as f64 / budget as f64
    }
}

/// Asserts that each kind allocates fewer than the given number of blocks per evaluation on a problem of a suite.
fn assert_fewer(cases: &[(&str, &str, &str, f64)]) {
    for (kind, suite, problem, most) in cases {
        let blocks = blocks(kind, suite, problem, 5000);
        assert!(blocks < *most, "{kind} {problem}: {blocks} blocks per evaluation");
    }
}

/// A generation allocates a few blocks for any population size: here for 100 members, or eight in `cma-es`.
#[test]
fn no_member_of_a_generation_allocates_memory() {
    assert_fewer(&[
        ("genetic", "bbob", "f8 i1 n5", 0.25),
        ("differential-evolution", "bbob", "f8 i1 n5", 0.25),
        ("nsga2", "zdt", "ZDT1", 0.01),
        ("nsga3", "zdt", "ZDT1", 0.25),
        ("cma-es", "bbob", "f8 i1 n5", 2.5),
    ]);
}

/// Steps of `sqp` and `pattern-search` reuse their memory. Allocations grow with the number of stored cuts and points.
/// A pattern needs a few blocks to shrink, and `pattern-search` creates an `sqp` solver at a kink.
#[test]
fn steps_allocate_almost_no_memory() {
    assert_fewer(&[
        ("sqp", "minimax", "Polak3", 0.05),
        ("sqp", "minimax", "EQUIL", 0.05),
        ("sqp", "hock-schittkowski", "HS106", 0.05),
        ("pattern-search", "hock-schittkowski", "HS106", 0.3),
        ("pattern-search", "minimax", "Polak3", 0.3),
        ("pattern-search", "minimax", "EQUIL", 0.3),
        ("pattern-search", "more-wild", "11 n6 m31", 0.3),
    ]);
}
