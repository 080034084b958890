//! Benchmark of solvers on problems with known solutions: number of solved problems, evaluations, time.

mod control;
pub(crate) mod figures;
mod fronts;
mod page;
mod plan;
mod profiles;
mod relative;
mod results;
mod suite;
mod timed;

use std::time::Instant;

use mops::core::Stop;
use mops::core::catalogue::SolverChoice;
use mops::core::problem::Evaluator;
use mops::{Catalogue, Watch};
use mops_problems::{Posed, Slope, Truth, measure};

use crate::parallel::each;
pub(crate) use fronts::{Spread, published, spreads};
pub(crate) use page::page;
pub(crate) use plan::{Plan, ROUGH};
pub(crate) use profiles::{Score, data_profile, performance_profile};
use results::Done;
pub(crate) use results::{Front, Results, Row};
pub(crate) use suite::{Subject, Suite, suites};
use timed::Timed;

/// Runs a plan on `jobs` threads; each run uses one thread, so that times are comparable.
pub(crate) fn run(catalogue: &Catalogue, plan: &Plan, jobs: usize, watch: &dyn Watch) -> Results {
    let subjects = plan.subjects();
    let mut tasks: Vec<Task<'_>> = Vec::new();
    for solver in &plan.solvers {
        for subject in &subjects {
            tasks.extend((1..=plan.seeds).map(|seed| Task { solver, subject, seed, slope: plan.slope }));
        }
    }
    let done = |tasks: &[Task<'_>]| each(tasks, jobs, watch, |task| one(catalogue, plan, task));
    let mut found = done(&tasks);
    if plan.suite.relative {
        let rivals = relative::rivals(catalogue);
        let mut rivalling: Vec<Task<'_>> = Vec::new();
        for subject in &subjects {
            rivalling.extend(rivals.iter().map(|solver| Task { solver, subject, seed: 1, slope: Slope::Differences }));
        }
        let others = done(&rivalling);
        relative::judge(&mut found, &others, plan.suite.accuracy);
    }
    Results::new(plan, found.into_iter().map(|done| done.row).collect(), watch.wants_stop())
}

/// Run to be executed.
#[derive(Clone, Copy)]
struct Task<'a> {
    solver: &'a SolverChoice,
    subject: &'a Subject,
    seed: u64,
    slope: Slope,
}

fn one(catalogue: &Catalogue, plan: &Plan, task: &Task<'_>) -> Option<Done> {
    match task.subject {
        Subject::Formula(problem) => {
            let posed = Posed::new(problem, task.slope).with_noise(plan.noise).with_seed(task.seed);
            let clean = Posed::new(problem, task.slope);
            let truth = |tuners: &[f64]| clean.evaluate(&clean.point_of(tuners)).merit;
            execute(plan, task, &posed, &posed.start(), if plan.noise > 0.0 { Some(&truth) } else { None })
        }
        Subject::Study(known) => {
            let posed = suite::posing(catalogue, known, task.seed);
            let start = posed.start();
            execute(plan, task, &posed, &start, None)
        }
    }
}

/// Executes a run; returns `None` if the solver does not accept the problem.
fn execute(
    plan: &Plan,
    task: &Task<'_>,
    posed: &impl Evaluator,
    start: &[f64],
    truth: Option<Truth<'_>>,
) -> Option<Done> {
    let Task { solver: choice, subject, seed, .. } = *task;
    let mut solver = choice.make();
    solver.accepts(posed.shape()).ok()?;
    let timed = Timed::new(posed);
    let thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started");
    let (budget, answer) = (plan.evaluations(start.len()), subject.answer());
    let (measured, seconds) = thread.install(|| {
        let started = Instant::now();
        let measured = measure(&answer, &timed, start, solver.as_mut(), budget, truth);
        (measured, started.elapsed().as_secs_f64())
    });
    let fine = measured.evaluations_to(subject.accuracy(&plan.suite));
    let row = Row {
        problem: subject.name().to_owned(),
        solver: choice.kind.to_owned(),
        seed,
        variables: start.len(),
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
        front: measured.front.map(Front::from),
    };
    Some(Done { row, history: measured.history })
}
