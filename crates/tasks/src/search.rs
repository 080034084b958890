//! Search for the best point: problem, run, solver, outcome.

use std::sync::Arc;
use std::time::Instant;

use mops_core::{
    Cancellation, Effect, Evaluation, Objective, Oracle, Problem, Role, Run, Shape, Solver, Stop, Study, StudyError,
    Watch,
    catalogue::{SolverChoice, TaskKind},
    run::{Budget, Patience, Quiet, Record, Store},
    solver::{Linearisation, Optimality, Pareto},
    task::Place,
};
use mops_outcome::{End, Ending, Outcome, conclude};

use crate::slopes::SlopesReport;
use crate::{Beyond, Contradiction, DerivativesReport};

use mops_content::numbers::{counted, significant};

/// Options of [`crate::solve()`].
#[derive(Clone)]
pub struct Options {
    /// Solver and its options.
    pub solver: SolverChoice,
    /// Largest number of evaluated points.
    pub max_evaluations: usize,
    /// Number of evaluated points at which the run ends although its solver counts on `max_evaluations`: where an
    /// unfinished run is replayed.
    pub replayed: Option<usize>,
    /// Patience with a search that hardly improves any more; without limit if absent.
    pub patience: Option<Patience>,
    /// Number of threads; all cores if absent. The result does not depend on it, bit for bit.
    pub jobs: Option<usize>,
    /// Tasks; that of the study is one of them.
    pub tasks: Vec<TaskKind>,
    /// Candidate effects of a diagnosis.
    pub effects: Vec<Arc<dyn Effect>>,
    /// Store of evaluated points, read and extended by the run. The result does not depend on it, bit for bit, except
    /// for
    /// [`EvaluationStore::begin`].
    pub keeping: Option<EvaluationStore>,
    /// Handle that stops the run, also within a simulation.
    pub cancellation: Cancellation,
}

/// Store of evaluated points, with the study that they belong to.
#[derive(Clone)]
pub struct EvaluationStore {
    /// Study of the stored points.
    pub study: Study,
    /// Store of the points.
    pub store: Arc<dyn Store>,
    /// Initial guess in the unit box, instead of the start values of the study. If set, the outcome reports the number
    /// of reused points.
    pub begin: Option<Vec<f64>>,
}

impl Options {
    /// Returns the store if its points have the same values in `problem`, else `None`.
    pub(crate) fn store(&self, problem: &Problem) -> Option<&dyn Store> {
        let keeping = self.keeping.as_ref()?;
        keeping.study.measures_as(problem.study()).then_some(&*keeping.store)
    }

    /// Returns the initial guess from the store, if it fits `problem`.
    fn begin(&self, problem: &Problem) -> Option<&[f64]> {
        let begin = self.keeping.as_ref()?.begin.as_deref()?;
        (self.store(problem).is_some() && begin.len() == problem.active().len()).then_some(begin)
    }
}

/// Default budget of a run, in evaluated points.
pub const DEFAULT_EVALUATIONS: usize = 20_000;

/// Result of [`crate::solve()`].
#[non_exhaustive]
pub struct Solved {
    /// Content of `result.json`.
    pub outcome: Outcome,
    /// Problem that was solved.
    pub problem: Problem,
    /// Evaluation at the reported point.
    pub best: Evaluation,
    /// Every evaluated point, in the order of evaluation.
    pub archive: Vec<Record>,
    /// Points of the Pareto front, in the order of the result; empty for other tasks.
    pub front: Vec<Evaluation>,
}

/// Reason why the solver or the task cannot handle the study, with a remedy and, if known, the key path in the study
/// file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SolveError(pub StudyError);

impl std::fmt::Display for SolveError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0.message)?;
        self.0.help.as_ref().map_or(Ok(()), |help| write!(f, "; {help}"))
    }
}

impl std::error::Error for SolveError {}

/// Checks that a solver can handle the task of a study, as far as possible without a simulation.
///
/// # Errors
/// If the solver does not accept the problem.
pub fn suits(study: &Study, solver: &SolverChoice) -> Result<(), SolveError> {
    // Excitation needs no criterion, and in a diagnosis every channel counts with its noise.
    if study.rows().is_empty() && study.task().needs_criteria() {
        let help =
            "add one, such as [criteria] followed by overshoot = { overshoot = { signal = \"y\" }, demand = 0.1 }";
        return Err(SolveError(StudyError::new("criteria", "the study has no criterion").with_help(help)));
    }
    if solves(study) { accepts(solver, solver.make().as_ref(), &Problem::outline(study)) } else { Ok(()) }
}

fn accepts(choice: &SolverChoice, solver: &dyn Solver, shape: &Shape) -> Result<(), SolveError> {
    solver.accepts(shape).map_err(|why| SolveError(StudyError::new(choice.kind, why).within("solver")))
}

/// Returns true if the task of a study needs a solver.
pub fn solves(study: &Study) -> bool {
    study.task().at() == Some(Place::Optimum)
}

/// Share of the budget kept for checks of the reported point: one part of so many.
const CHECKS: usize = 10;

/// Limits of a search, in evaluated points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Points on which the solver counts.
    pub planned: usize,
    /// Points after which the search ends.
    pub searched: usize,
    /// Points of the search and of the checks of its result.
    pub all: usize,
}

/// What a search finds besides the best point.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Extras {
    /// Derivatives of the criteria with respect to the tuners.
    pub slopes: bool,
    /// Another point with the same objective.
    pub twin: bool,
}

/// Runs the solver and returns its outcome. A part of the budget is kept for checks of the reported point.
///
/// # Errors
/// If the solver does not accept the problem.
pub(crate) fn search(study: Study, options: &Options, watch: &dyn Watch) -> Result<Solved, SolveError> {
    search_for(Extras::default(), study, options, watch)
}

/// Runs the solver as [`search`] does, for further findings.
///
/// # Errors
/// If the solver does not accept the problem.
pub(crate) fn search_for(
    extras: Extras,
    study: Study,
    options: &Options,
    watch: &dyn Watch,
) -> Result<Solved, SolveError> {
    let planned = options.max_evaluations.max(1);
    let limits = Limits { planned, searched: planned - planned / CHECKS, all: planned };
    search_within(limits, extras, study, options, watch)
}

/// Runs the solver within the limits and returns its outcome.
///
/// # Errors
/// If the solver does not accept the problem.
pub(crate) fn search_within(
    limits: Limits,
    extras: Extras,
    study: Study,
    options: &Options,
    watch: &dyn Watch,
) -> Result<Solved, SolveError> {
    let started = Instant::now();
    let problem = Problem::new(Arc::new(study));
    let mut solver = options.solver.make();
    accepts(&options.solver, solver.as_ref(), problem.shape())?;
    let (store, begin) = (options.store(&problem), options.begin(&problem));
    let evaluations = options.replayed.unwrap_or(limits.searched).max(1);
    let run = Run::new(&problem, Budget { evaluations }, watch).planned(limits.planned);
    let mut run = run.patient(options.patience).keeping(store);
    let start = begin.map_or_else(|| problem.start(), <[f64]>::to_vec);
    let stop = run.solve(solver.as_mut(), &start);
    if run.archive().is_empty() {
        let known = store.and_then(|store| store.known(&problem.tuners_at(&start)));
        let answer = problem.concluding().evaluate_keeping(&start, known);
        if !answer.evaluation.is_cancelled() {
            run.take_start(answer);
        }
    }
    // Of a front, the point nearest to the demands is reported.
    let nearest = run.front().into_iter().min_by(|&a, &b| {
        let worst = |i: usize| run.archive()[i].merit.objective;
        worst(a).total_cmp(&worst(b))
    });
    if let Some(nearest) = nearest {
        run.settle(run.evaluation(nearest).clone());
    }
    let quiet = Quiet(watch);
    let left = Budget { evaluations: limits.all.saturating_sub(run.archive().len()) };
    let mut probe = Run::new(&problem, left, &quiet).keeping(store);
    let (mut point, mut pareto) = shown(&run, &mut probe, watch);
    let has_slack = pareto == Pareto::No && problem.shape().objective == Objective::Max;
    if has_slack && stop != Stop::Interrupted && remove_slack(&mut run) {
        (point, pareto) = shown(&run, &mut probe, watch);
    }
    let stop = if stop == Stop::Converged && matches!(point, Optimality::Plateau | Optimality::Descent) {
        Stop::Stalled
    } else {
        stop
    };
    // An evaluated point may be evaluated again for its exact derivatives, whatever the budget: no new point counts.
    let mut again = Run::new(&problem, Budget { evaluations: 1 }, &quiet);
    let near = run.best();
    let near =
        near.and_then(|best| linearised(best, &mut probe, watch).or_else(|| linearised(best, &mut again, watch)));
    let derivatives = near.as_ref().filter(|(_, is_exact)| *is_exact);
    let derivatives = derivatives.map(|(found, _)| DerivativesReport::of(&problem, &mut probe, found));
    let contradiction = derivatives.as_ref().and_then(contradiction);
    let mut slopes = near.filter(|_| extras.slopes).map(|(found, _)| SlopesReport::of(&problem, &found));
    if let (Some(slopes), Some(best), false) = (&mut slopes, run.best(), point == Optimality::Stationary) {
        slopes.add_sides(&problem, &mut probe, best);
    }
    let jumping = derivatives.as_ref().filter(|found| !found.jumps.is_empty());
    let is_hidden = contradiction.is_some() || jumping.is_some() && pareto == Pareto::CertifiedLocal;
    let pareto = if is_hidden { Pareto::NotShown } else { pareto };
    let ending = Ending { stop, end: None, pareto, seconds: started.elapsed().as_secs_f64() };
    let (mut outcome, best) = conclude(&run, &options.solver, ending);
    // A replay ends where the run was interrupted, not at a budget.
    let cause = if options.replayed.is_some() { Stop::Interrupted } else { stop };
    let end = run.best().map(|best| {
        let is_noise = best.merit.is_feasible() && problem.shape().is_noise(best.merit.objective) && is_white(&outcome);
        let end = End::new(point, best.merit, solver.ends(), cause, is_noise);
        let twin = if extras.twin { twin(&run, best) } else { None };
        let end = twin.into_iter().fold(end, End::with_twin);
        let mut end = contradiction.clone().into_iter().fold(end, End::with_contradiction);
        if let Some(found) = jumping {
            end = end.beside_jump(found.jumps_to_better);
        }
        end.words.extend(derivatives.iter().flat_map(|found| found.beyond.iter().map(beyond)));
        end.words.extend(derivatives.as_ref().and_then(not_compared));
        end
    });
    outcome.end = end;
    outcome.methods = solver.methods().to_vec();
    outcome.evaluations += probe.archive().len();
    let simulated: usize = [&probe, &again].iter().map(|run| run.archive().len() + run.linearisations()).sum();
    outcome.simulations += simulated * problem.simulations();
    if let Some(slopes) = slopes {
        outcome.found.add(slopes);
    }
    if let Some(derivatives) = derivatives {
        outcome.found.add(derivatives);
    }
    outcome.seconds = started.elapsed().as_secs_f64();
    outcome.reused = begin.map(|_| run.reused());
    let archive = run.archive().to_vec();
    drop((run, probe));
    Ok(Solved { outcome, problem, best, archive, front: Vec::new() })
}

/// Returns true if no test of the residuals of calibration data rejects that they are white.
fn is_white(outcome: &Outcome) -> bool {
    let experiments = outcome.calibration.iter().flat_map(|calibration| &calibration.experiments);
    let fitted = experiments.filter(|experiment| experiment.role == Role::Calibration);
    fitted.flat_map(|experiment| &experiment.channels).all(|channel| channel.whiteness.is_none_or(|w| w.is_white()))
}

/// Difference of the objective, relative to its value, that is rounding and the tolerance of a search.
const SAME_FIT: f64 = 1e-6;

/// Difference of a tuner, as a part of its range, that makes another point.
const ELSEWHERE: f64 = 0.05;

/// Returns a sentence on the point farthest from the best one with the same objective, if there is one.
fn twin(run: &Run<'_>, best: &Evaluation) -> Option<String> {
    let study = run.problem().study();
    let same = best.merit.objective * (1.0 + SAME_FIT);
    let shift = |at: &[f64], i: usize| {
        let tuner = &study.tuners()[i];
        let shift = (tuner.position_of(at[i]) - tuner.position_of(best.tuners[i])).abs();
        if tuner.active && shift.is_finite() { shift } else { 0.0 }
    };
    let all = 0..study.tuners().len();
    let distance = |at: &[f64]| all.clone().map(|i| shift(at, i)).fold(0.0, f64::max);
    let others = run.archive().iter().filter(|record| record.merit.is_feasible() && record.merit.objective <= same);
    let other = others.max_by(|a, b| distance(&a.tuners).total_cmp(&distance(&b.tuners)))?;
    let mut moved: Vec<usize> = all.clone().filter(|&i| shift(&other.tuners, i) > ELSEWHERE).collect();
    moved.sort_by(|&a, &b| shift(&other.tuners, b).total_cmp(&shift(&other.tuners, a)));
    if moved.is_empty() {
        return None;
    }
    let values = moved.iter().take(3).map(|&i| {
        let [there, here] = [&other.tuners, &best.tuners].map(|tuners| significant(tuners[i], 4));
        format!("{} = {there} (here {here})", study.tuners()[i].name)
    });
    let values: Vec<String> = values.collect();
    Some(format!(
        "Not unique: another point fits as well, {}; the data do not distinguish them. Limit the ranges of the tuners, fix one, or \
         add data.",
        values.join(", ")
    ))
}

/// Lowers the criteria of the best point that do not decide its objective, while the others stay. Returns true if there
/// is such a point.
fn remove_slack(run: &mut Run<'_>) -> bool {
    let Some(best) = run.best().cloned() else { return false };
    // Without a result at the end of the budget, the point stays.
    let Ok(Some(found)) = mops_solvers::remove_slack(run, &best.point) else { return false };
    let is_as_good = found.merit.is_feasible() && found.merit.objective <= best.merit.objective;
    if is_as_good {
        run.settle(found);
    }
    is_as_good
}

/// Evaluates the start values only and returns the outcome.
pub(crate) fn evaluate_start(study: Study, options: &Options, watch: &dyn Watch) -> Solved {
    let started = Instant::now();
    let problem = Problem::new(Arc::new(study));
    let concluding = problem.concluding();
    let mut run = Run::new(&problem, Budget { evaluations: 1 }, watch);
    if run.evaluate(&[problem.start()]).is_err() && run.best().is_none() {
        // The outcome needs this single point.
        run = Run::new(&concluding, Budget { evaluations: 1 }, &());
        let _ = run.evaluate(&[problem.start()]);
    }
    // N.B.: reported as interrupted, so that no initial states are estimated either.
    let ending = Ending { stop: Stop::Interrupted, end: None, pareto: Pareto::NotShown, seconds: 0.0 };
    let (mut outcome, best) = conclude(&run, &options.solver, ending);
    let stop = if watch.wants_stop() { watch.halt().into() } else { Stop::Converged };
    (outcome.solver, outcome.stop) = ("none".to_owned(), stop);
    outcome.seconds = started.elapsed().as_secs_f64();
    let archive = run.archive().to_vec();
    drop(run);
    Solved { outcome, problem, best, archive, front: Vec::new() }
}

/// Difference step of the derivatives at the reported point, in the unit box. Equal to that of the Pareto certificate,
/// whose derivatives are then reused.
const NEAR: f64 = 1e-4;

/// Returns values and derivatives at a point, and whether these are exact; `None` if a simulation near it fails, if no
/// tuner can be changed, or after a stop request.
pub(crate) fn linearised(at: &Evaluation, probe: &mut Run<'_>, watch: &dyn Watch) -> Option<(Linearisation, bool)> {
    if at.scaled.is_none() || at.point.is_empty() || watch.wants_stop() {
        return None;
    }
    let before = probe.linearisations();
    let found = probe.linearise(&at.point, NEAR).ok()??;
    Some((found, probe.linearisations() > before))
}

/// Returns a sentence on the first derivative that simulations contradict.
pub(crate) fn contradiction(found: &DerivativesReport) -> Option<String> {
    let Contradiction { key, tuner, derivative, differences } = found.contradictions.first()?;
    let along =
        tuner.as_ref().map_or_else(|| "in a direction".to_owned(), |tuner| format!("with respect to `{tuner}`"));
    let differences: Vec<String> = differences.iter().flatten().map(|d| significant(*d, 4)).collect();
    let others = found.contradictions.len() - 1;
    let more = if others > 0 { format!(" ({others} more in result.json)") } else { String::new() };
    Some(format!(
        "Simulations contradict the derivative of `{key}` {along}: {} per range of the tuners, and differences give {}{more}. \
         What rests on derivatives is not shown: compare with --solver pattern-search.",
        significant(*derivative, 4),
        differences.join(" and ")
    ))
}

/// Returns a sentence on a tuner that has an effect only at a distance.
fn beyond(found: &Beyond) -> String {
    let [here, there] = found.scaled.map(|scaled| significant(scaled, 4));
    format!(
        "`{}` has no effect near the point, but moved by a tenth of its range it changes the scaled value of `{}` from {here} to {there}.",
        found.tuner, found.key
    )
}

/// Returns a sentence on the comparisons that the budget did not cover, if any.
fn not_compared(found: &DerivativesReport) -> Option<String> {
    let all = found.directions + found.left_out;
    (found.left_out > 0).then(|| {
        format!(
            "{} of {} of the derivatives with simulations {} left out: the budget was spent.",
            found.left_out,
            counted(all, "comparison"),
            if found.left_out == 1 { "was" } else { "were" }
        )
    })
}

/// Returns what is shown of the best point: its classification for the objective, and its Pareto optimality.
fn shown(run: &Run<'_>, probe: &mut Run<'_>, watch: &dyn Watch) -> (Optimality, Pareto) {
    run.best().cloned().into_iter().for_each(|best| probe.learn(best));
    let point = optimality(run, probe, watch);
    (point, pareto(run, point, probe, watch))
}

/// Classifies the best point to first order. Where nothing is minimised, a feasible point is as good as any other.
fn optimality(run: &Run<'_>, probe: &mut Run<'_>, watch: &dyn Watch) -> Optimality {
    let is_asked = |best: &&Evaluation| run.problem().shape().objective_count() > 0 || !best.merit.is_feasible();
    let best = run.best().filter(|best| best.scaled.is_some() && !watch.wants_stop()).filter(is_asked);
    best.map_or(Optimality::NotShown, |best| mops_solvers::optimality(probe, &best.point))
}

/// Checks the best point, with its classification for the objective, for Pareto optimality.
fn pareto(run: &Run<'_>, point: Optimality, probe: &mut Run<'_>, watch: &dyn Watch) -> Pareto {
    let shape = run.problem().shape();
    let minimised = shape.objective_count();
    let Some(best) = run.best().filter(|best| best.merit.is_feasible() && minimised > 0 && !watch.wants_stop()) else {
        return Pareto::NotShown;
    };
    // A local minimum of one criterion, or of a sum with positive weights, is locally Pareto-optimal.
    if shape.objective == Objective::Sum || minimised == 1 {
        return if point.is_stationary() { Pareto::CertifiedLocal } else { Pareto::NotShown };
    }
    match mops_solvers::certificate(probe, &best.point).pareto {
        Pareto::CertifiedLocal if !point.is_stationary() => Pareto::NotShown,
        pareto => pareto,
    }
}

#[cfg(test)]
mod tests;
