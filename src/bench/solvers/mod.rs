//! How well solvers do on problems with known answers: how many they solve, with how many evaluations, in what time.

mod page;
mod profiles;
mod results;
mod timed;

use std::time::Instant;

use mops_core::{Evaluator, SolverChoice, Stop, Watch};
use mops_problems::{Posed, Problem, Slope, Suite, measure};

use super::each;
pub(crate) use page::page;
pub(crate) use profiles::{Score, data_profile, performance_profile};
pub(crate) use results::{Results, Row};
use timed::Timed;

/// What is run.
pub(crate) struct Plan {
    pub suite: Suite,
    pub solvers: Vec<SolverChoice>,
    pub slope: Slope,
    /// Seeds 1 to this.
    pub seeds: u64,
    /// Evaluations a run may take, for every variable and one more.
    pub budget: usize,
    /// Relative noise that is added to all values.
    pub noise: f64,
    /// Problems by name; all where empty.
    pub only: Vec<String>,
}

/// Accuracy of the first count of evaluations.
pub(crate) const ROUGH: f64 = 1e-3;

/// Runs a plan on so many threads; every run has one to itself, so that times are comparable.
pub(crate) fn run(plan: &Plan, jobs: usize, watch: &dyn Watch) -> Results {
    let problems: Vec<Problem> = (plan.suite.problems)();
    let chosen = |problem: &&Problem| plan.only.is_empty() || plan.only.contains(&problem.name);
    let problems: Vec<&Problem> = problems.iter().filter(chosen).collect();
    let tasks: Vec<(&SolverChoice, &Problem, u64)> = plan
        .solvers
        .iter()
        .flat_map(|solver| {
            problems.iter().flat_map(move |problem| (1..=plan.seeds).map(move |s| (solver, *problem, s)))
        })
        .collect();
    let rows = each(&tasks, jobs, watch, |(solver, problem, seed)| one(plan, solver, problem, *seed));
    Results::new(plan, rows)
}

/// `None` where the solver does not accept the problem.
fn one(plan: &Plan, choice: &SolverChoice, problem: &Problem, seed: u64) -> Option<Row> {
    let posed = Posed::new(problem, plan.slope).with_noise(plan.noise).with_seed(seed);
    let mut solver = choice.make();
    solver.accepts(posed.shape()).ok()?;
    let timed = Timed::new(&posed);
    let thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started");
    let budget = plan.budget * (problem.dimension() + 1);
    let (measured, seconds) = thread.install(|| {
        let begun = Instant::now();
        let measured = measure(problem, &timed, &posed.start(), solver.as_mut(), budget);
        (measured, begun.elapsed().as_secs_f64())
    });
    let fine = measured.evaluations_to(problem.accuracy.unwrap_or(plan.suite.accuracy));
    Some(Row {
        problem: problem.name.clone(),
        solver: choice.kind.to_owned(),
        seed,
        variables: problem.dimension(),
        rows: posed.shape().rows.len(),
        known: measured.target,
        reached: measured.best.objective,
        violation: measured.best.violation,
        evaluations: measured.history.len(),
        linearisations: measured.linearisations,
        to_rough: measured.evaluations_to(ROUGH),
        to_fine: fine,
        solved: fine.is_some(),
        converged: measured.stop == Stop::Converged,
        seconds,
        solver_seconds: (seconds - timed.seconds()).max(0.0),
    })
}
