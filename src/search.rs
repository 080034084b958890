//! A search for the best point: problem, run, solver, conclusion.

use std::sync::Arc;
use std::time::Instant;

use mops_core::{
    Budget, Cancellation, Effect, Ending, Evaluation, Objective, Oracle, Outcome, Pareto, Place, Problem, Quiet,
    Record, Run, Shape, SlopesReport, Solver, SolverChoice, Stop, Store, Study, StudyError, Task, Watch, conclude,
};

use mops_discrepancy::Diagnosis;

/// How a study is solved.
#[derive(Clone)]
pub struct Options {
    /// The solver.
    pub solver: SolverChoice,
    /// Largest number of points evaluated.
    pub max_evaluations: usize,
    /// Number of threads; all cores where absent. It changes no bit of the result.
    pub jobs: Option<usize>,
    /// Effects that a diagnosis may find.
    pub effects: Vec<Arc<dyn Effect>>,
    /// Where points are kept, and what is known of them from before; it changes no bit of the result.
    pub keeping: Option<EvaluationStore>,
    /// Asks the run to end, within a simulation too.
    pub cancellation: Cancellation,
}

/// A store, and the study whose points it knows.
#[derive(Clone)]
pub struct EvaluationStore {
    /// The study.
    pub study: Study,
    /// Its points.
    pub store: Arc<dyn Store>,
    /// The point of the unit box at which a search begins, instead of the start values; with one, the outcome reports how many
    /// points were known.
    pub begin: Option<Vec<f64>>,
}

impl Options {
    /// The store, for a problem in which points have the values that it knows; else none.
    pub(crate) fn store(&self, problem: &Problem) -> Option<&dyn Store> {
        let keeping = self.keeping.as_ref()?;
        keeping.study.measures_as(problem.study()).then_some(&*keeping.store)
    }

    /// Where a search begins, if not at the start values.
    fn begin(&self, problem: &Problem) -> Option<&[f64]> {
        let begin = self.keeping.as_ref()?.begin.as_deref()?;
        (self.store(problem).is_some() && begin.len() == problem.active().len()).then_some(begin)
    }
}

/// Points a run may evaluate where nothing else is said.
pub const DEFAULT_EVALUATIONS: usize = 20_000;

impl Default for Options {
    fn default() -> Self {
        let solver = mops_solvers::kinds().first().expect("there are solvers").default_choice();
        Self {
            solver,
            max_evaluations: DEFAULT_EVALUATIONS,
            jobs: None,
            effects: mops_effects::effects(),
            keeping: None,
            cancellation: Cancellation::default(),
        }
    }
}

/// A solved study.
pub struct Solved {
    /// What `result.json` holds.
    pub outcome: Outcome,
    /// The problem.
    pub problem: Problem,
    /// The evaluation that is reported.
    pub best: Evaluation,
    /// Every point, in the order of evaluation.
    pub archive: Vec<Record>,
    /// Points of the front, in the order of the result; empty where none was looked for.
    pub front: Vec<Evaluation>,
    /// What the model lacks, where that was searched.
    pub diagnosis: Option<Diagnosis>,
}

/// The solver or the task cannot treat the study: why, and what would; with the keys that lead to the place, if there is one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SolveError(pub StudyError);

impl std::fmt::Display for SolveError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0.message)?;
        self.0.help.as_ref().map_or(Ok(()), |help| write!(f, "; {help}"))
    }
}

impl std::error::Error for SolveError {}

/// Whether a solver can do the task of a study, as far as that is known without a simulation.
///
/// # Errors
/// The solver cannot treat the problem.
pub fn suits(study: &Study, solver: &SolverChoice) -> Result<(), SolveError> {
    if solves(study) { accepts(solver, solver.make().as_ref(), &Problem::outline(study)) } else { Ok(()) }
}

fn accepts(choice: &SolverChoice, solver: &dyn Solver, shape: &Shape) -> Result<(), SolveError> {
    solver.accepts(shape).map_err(|why| SolveError(StudyError::new(choice.kind, why).within("solver")))
}

/// Whether the task of a study needs a solver.
pub(crate) fn solves(study: &Study) -> bool {
    match study.task() {
        Task::Design | Task::Calibration | Task::Pareto => true,
        Task::Excitation | Task::Diagnosis => false,
        Task::Sensitivity => study.tasks().sensitivity.at == Place::Optimum,
        Task::Sweep => study.tasks().sweep.as_ref().is_none_or(|sweep| sweep.at == Place::Optimum),
        Task::WorstCase => study.tasks().worst_case.at == Place::Optimum,
        Task::MonteCarlo => study.tasks().monte_carlo.at == Place::Optimum,
    }
}

/// Searches for the best point, and concludes.
///
/// # Errors
/// The solver cannot treat the problem.
pub(crate) fn search(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    let begun = Instant::now();
    let problem = Problem::new(Arc::new(study));
    let mut solver = options.solver.make();
    accepts(&options.solver, solver.as_ref(), problem.shape())?;
    let (store, begin) = (options.store(&problem), options.begin(&problem));
    let mut run = Run::new(&problem, Budget { evaluations: options.max_evaluations.max(1) }, watch).keeping(store);
    let start = begin.map_or_else(|| problem.start(), <[f64]>::to_vec);
    let stop = run.solve(solver.as_mut(), &start);
    if run.archive().is_empty() {
        let known = store.and_then(|store| store.known(&problem.tuners_at(&start)));
        let answer = problem.concluding().evaluate_keeping(&start, known);
        if !answer.evaluation.is_cancelled() {
            run.take_start(answer);
        }
    }
    let quiet = Quiet(watch);
    let pareto = pareto(&run, stop, (store, &quiet));
    let ending = Ending { stop, pareto, seconds: begun.elapsed().as_secs_f64() };
    let (mut outcome, best) = conclude(&run, &options.solver, ending);
    outcome.methods = solver.methods().to_vec();
    outcome.found.slopes = slopes(&run, (store, &quiet));
    outcome.seconds = begun.elapsed().as_secs_f64();
    outcome.reused = begin.map(|_| run.reused());
    let archive = run.archive().to_vec();
    drop(run);
    Ok(Solved { outcome, problem, best, archive, front: Vec::new(), diagnosis: None })
}

/// Looks at the start values alone, and concludes.
pub(crate) fn look(study: Study, options: &Options, watch: &dyn Watch) -> Solved {
    let begun = Instant::now();
    let problem = Problem::new(Arc::new(study));
    let concluding = problem.concluding();
    let mut run = Run::new(&problem, Budget { evaluations: 1 }, watch);
    if run.evaluate(&[problem.start()]).is_err() && run.best().is_none() {
        // This single point is needed to conclude.
        run = Run::new(&concluding, Budget { evaluations: 1 }, &());
        let _ = run.evaluate(&[problem.start()]);
    }
    // N.B.: as if it were interrupted, so that no start value is estimated either.
    let ending = Ending { stop: Stop::Interrupted, pareto: Pareto::NotShown, seconds: 0.0 };
    let (mut outcome, best) = conclude(&run, &options.solver, ending);
    let stop = if watch.wants_stop() { watch.halt().into() } else { Stop::Converged };
    (outcome.solver, outcome.stop) = ("none".to_owned(), stop);
    outcome.seconds = begun.elapsed().as_secs_f64();
    let archive = run.archive().to_vec();
    drop(run);
    Solved { outcome, problem, best, archive, front: Vec::new(), diagnosis: None }
}

/// The distance within which the slopes at the reported point describe the problem, in the unit box; that of the certificate,
/// so that they are known from it.
const NEAR: f64 = 1e-4;

/// How the criteria of a design change with its tuners at the best point; nothing where the user does not want to wait.
fn slopes(run: &Run<'_>, (store, watch): (Option<&dyn Store>, &dyn Watch)) -> Option<SlopesReport> {
    let problem = run.problem();
    if problem.study().task() != Task::Design || watch.wants_stop() {
        return None;
    }
    let mut probe = Run::new(problem, Budget { evaluations: usize::MAX }, watch).keeping(store);
    SlopesReport::at(problem, &mut probe, &run.best()?.point, NEAR)
}

/// Whether the best point is Pareto-optimal, as far as that is known.
fn pareto(run: &Run<'_>, stop: Stop, (store, watch): (Option<&dyn Store>, &dyn Watch)) -> Pareto {
    let problem = run.problem();
    match run.best().filter(|best| best.merit.is_feasible()) {
        None => Pareto::NotShown,
        Some(_) if watch.wants_stop() => Pareto::NotShown,
        // A minimum of a sum with positive weights is Pareto-optimal.
        Some(_) if problem.shape().objective == Objective::Sum && stop == Stop::Converged => Pareto::CertifiedLocal,
        Some(best) => {
            let mut probe = Run::new(problem, Budget { evaluations: usize::MAX }, watch).keeping(store);
            mops_solvers::certify(&mut probe, &best.point)
        }
    }
}

#[cfg(test)]
mod tests;
