//! Runs: a [`Run`] owns the budget, the cache, the archive and the random streams, and keeps the best point.

pub use crate::problem::{CachedGradients, CachedPoint, JobValues, Known, RowSlopes, RowValue, Store};

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hasher};

use mops_math::{Stream, stream};
use rayon::prelude::*;

use crate::cancellation::Halt;
use crate::evaluation::{Evaluation, Merit, Objective};
use crate::failure::Failure;
use crate::front;
use crate::problem::{Evaluator, Problem, Slopes};
use crate::solver::{Differences, Linearisation, Oracle, Progress, Shape, Solver, Stop};

/// Budget of a run.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    /// Maximum number of evaluated points.
    pub evaluations: usize,
}

/// Limit of a run whose best point hardly improves any more.
#[derive(Debug, Clone, Copy)]
pub struct Patience {
    /// Smallest number of evaluations after the last gain.
    pub least: usize,
    /// Smallest number of evaluations after the last gain, relative to those before it.
    pub ratio: usize,
    /// Decrease of the objective, or of the violation of an infeasible point, that counts as a gain, in scaled values.
    pub gain: f64,
}

/// Observer of a run, which may also stop it. Only the observer reads the clock, so that time changes no number.
pub trait Watch: Sync {
    /// Returns true if the run must stop now.
    fn wants_stop(&self) -> bool {
        false
    }

    /// Returns the reason for stopping.
    fn halt(&self) -> Halt {
        Halt::Interrupted
    }

    /// Called after new points were evaluated.
    fn evaluated(&self, _state: &State) {}

    /// Called when the best point changed, at most once after each [`Watch::evaluated`].
    fn improved(&self, _best: &Evaluation) {}

    /// Called at each stage of work that evaluates no points, such as `screening 412 candidates`. `done` is the
    /// finished share of the work, from 0 to 1.
    fn stage(&self, _what: &str, _done: f64) {}

    /// Called with the reason when results cannot be stored. Called with `None` once storing works again and all
    /// results are stored.
    fn keeping(&self, _trouble: Option<&str>) {}
}

/// The unit type observes nothing.
impl Watch for () {}

/// Observer that only forwards stop requests, for searches inside a task.
pub struct Quiet<'a>(pub &'a dyn Watch);

impl Watch for Quiet<'_> {
    fn wants_stop(&self) -> bool {
        self.0.wants_stop()
    }

    fn halt(&self) -> Halt {
        self.0.halt()
    }
}

/// Progress of a run.
#[derive(Debug, Clone, Copy)]
pub struct State {
    /// Number of evaluated points.
    pub evaluations: usize,
    /// Number of points that the solver counts on; a run may end before.
    pub budget: usize,
    /// Number of failed points.
    pub failed: usize,
    /// Merit of the best point so far.
    pub best: Merit,
}

/// An evaluated point, as kept for the report.
#[derive(Debug, Clone)]
pub struct Record {
    /// Values of all tuners.
    pub tuners: Vec<f64>,
    /// Values of all rows; NaN for rows without a value.
    pub values: Vec<f64>,
    /// Weighted scaled values of the rows to be minimised if each is an objective of its own; else empty.
    pub objectives: Vec<f64>,
    /// Merit of the point.
    pub merit: Merit,
}

/// A run of a solver on a problem: the problem of a study, or one with a known solution.
pub struct Run<'a, E: Evaluator = Problem> {
    problem: &'a E,
    budget: Budget,
    /// Budget that the solver counts on, if the run is to end before it.
    planned: Option<usize>,
    patience: Option<Patience>,
    /// True while residuals are asked for, also of points evaluated before. They are not kept: a calibration may have
    /// more samples times evaluations than memory.
    needs_residuals: bool,
    watch: &'a dyn Watch,
    store: Option<&'a dyn Store>,
    /// Number of points answered from the store, without a simulation.
    reused: usize,
    /// True if the best point changed since the last notification.
    improved: bool,
    cache: HashMap<Vec<u64>, Evaluation, BuildHasherDefault<Bits>>,
    failed: usize,
    archive: Vec<Record>,
    best: Option<Evaluation>,
    failures: Vec<FailureCount>,
    /// True if exact derivatives from tangents are used where available.
    exact: bool,
    linearisations: usize,
    /// Points of the Pareto front that the solver has solved for, as values of all tuners.
    solved: Vec<Vec<f64>>,
}

/// Failures of one kind in one job.
#[derive(Debug, Clone)]
pub struct FailureCount {
    /// Index of the job.
    pub job: usize,
    /// First failure.
    pub first: Failure,
    /// Number of failures.
    pub count: usize,
}

impl<'a, E: Evaluator> Run<'a, E> {
    /// Creates a run that has not started.
    pub fn new(problem: &'a E, budget: Budget, watch: &'a dyn Watch) -> Self {
        Self {
            problem,
            budget,
            planned: None,
            patience: None,
            needs_residuals: false,
            watch,
            store: None,
            reused: 0,
            improved: false,
            cache: HashMap::default(),
            failed: 0,
            archive: Vec::new(),
            best: None,
            failures: Vec::new(),
            exact: true,
            linearisations: 0,
            solved: Vec::new(),
        }
    }

    /// Sets the budget that the solver counts on; the run ends at its own, smaller budget.
    #[must_use]
    pub fn planned(self, evaluations: usize) -> Self {
        Self { planned: Some(evaluations), ..self }
    }

    /// Ends the run, as stalled, when its best point has not improved for long.
    #[must_use]
    pub fn patient(self, patience: Option<Patience>) -> Self {
        Self { patience, ..self }
    }

    /// Uses finite differences only, for comparison.
    #[must_use]
    pub fn by_differences(self) -> Self {
        Self { exact: false, ..self }
    }

    /// Stores results in a store, and takes cached results from it instead of simulating.
    #[must_use]
    pub fn keeping(self, store: Option<&'a dyn Store>) -> Self {
        Self { store, ..self }
    }

    /// Returns the number of points answered from the store, without a simulation.
    pub fn reused(&self) -> usize {
        self.reused
    }

    /// Returns the number of exact linearisations. Each is a simulation with tangents of every job that counts.
    pub fn linearisations(&self) -> usize {
        self.linearisations
    }

    /// Runs the solver to its end from `start`, a point of the unit box.
    pub fn solve(&mut self, solver: &mut dyn Solver, start: &[f64]) -> Stop {
        // The start is evaluated first, so that there is a point to report, unless even this evaluation is cancelled.
        let first = self.answer(start);
        if first.evaluation.is_cancelled() {
            return self.watch.halt().into();
        }
        self.keep(key(self.problem, start), first);
        self.notify();
        let mut iterate = || -> Result<Stop, Halt> {
            solver.begin(self, start)?;
            let mut last_gain = (0, Merit::FAILED);
            loop {
                match solver.step(self)? {
                    Progress::Continue if self.is_exhausted(&mut last_gain) => return Ok(Stop::Stalled),
                    Progress::Continue => {}
                    Progress::Converged => return Ok(Stop::Converged),
                    Progress::Stalled => return Ok(Stop::Stalled),
                }
            }
        };
        let stop = iterate().unwrap_or_else(Stop::from);
        self.solved = solver.front().iter().map(|point| self.problem.tuners_at(point)).collect();
        stop
    }

    /// Returns true if the best point has not improved for longer than the patience of the run. `last_gain` holds the
    /// number of evaluations and the merit at the last gain.
    fn is_exhausted(&self, last_gain: &mut (usize, Merit)) -> bool {
        let (Some(patience), Some(best)) = (self.patience, &self.best) else { return false };
        let (at, before) = *last_gain;
        let is_gain = match (before.is_feasible(), best.merit.is_feasible()) {
            (true, _) => before.objective - best.merit.objective > patience.gain,
            (false, true) => true,
            // N.B.: a failed point has an infinite violation.
            (false, false) => before.violation - best.merit.violation > patience.gain,
        };
        if is_gain {
            *last_gain = (self.archive.len(), best.merit);
            return false;
        }
        self.archive.len() - at > patience.least.max(patience.ratio * at)
    }

    /// Records an evaluation of the start made elsewhere, so that a run cancelled before its first evaluation has a
    /// point to report.
    pub fn take_start(&mut self, answer: CachedPoint) {
        let key = bits(&answer.evaluation.tuners);
        self.keep(key, answer);
    }

    /// Takes over an evaluation of another run of the same problem. It does not count.
    pub fn learn(&mut self, evaluation: Evaluation) {
        self.cache.insert(bits(&evaluation.tuners), evaluation);
    }

    /// Sets the reported point to an evaluated one with the same objective, such as one that dominates the best point.
    pub fn settle(&mut self, evaluation: Evaluation) {
        self.best = Some(evaluation);
    }

    /// Returns all points, in the order of their evaluation.
    pub fn archive(&self) -> &[Record] {
        &self.archive
    }

    /// Returns the failures, by job and kind.
    pub fn failures(&self) -> &[FailureCount] {
        &self.failures
    }

    /// Returns the problem.
    pub fn problem(&self) -> &'a E {
        self.problem
    }

    /// Returns the Pareto front, as indices into the archive. Empty for a single objective.
    ///
    /// The points are those that the solver has solved for ([`Solver::front`]), each replaced by a better point if
    /// there is one. If the solver has solved for none, all non-dominated points are returned.
    pub fn front(&self) -> Vec<usize> {
        let all = self.non_dominated();
        if self.solved.is_empty() {
            return all;
        }
        let solved = self.solved.iter().filter_map(|tuners| self.archive.iter().position(|r| r.tuners == *tuners));
        let least_worst = |i: usize| {
            let reached = |j: usize| {
                let pairs = self.archive[j].objectives.iter().zip(&self.archive[i].objectives);
                pairs.map(|(a, b)| a - b).fold(f64::NEG_INFINITY, f64::max)
            };
            all.iter().copied().min_by(|&a, &b| reached(a).total_cmp(&reached(b)))
        };
        let mut front: Vec<usize> =
            solved.filter_map(|i| if all.contains(&i) { Some(i) } else { least_worst(i) }).collect();
        front.sort_unstable();
        front.dedup();
        front
    }

    /// Returns the feasible, non-dominated points, as indices into the archive. Empty for a single objective.
    pub fn non_dominated(&self) -> Vec<usize> {
        let feasible = |i: &usize| self.archive[*i].merit.is_feasible() && !self.archive[*i].objectives.is_empty();
        let candidates: Vec<usize> = (0..self.archive.len()).filter(feasible).collect();
        let Some(m) = candidates.first().map(|&i| self.archive[i].objectives.len()) else { return Vec::new() };
        let objectives: Vec<f64> =
            candidates.iter().flat_map(|&i| self.archive[i].objectives.iter().copied()).collect();
        front::non_dominated(&objectives, m).into_iter().map(|i| candidates[i]).collect()
    }

    /// Returns the evaluation of a point of the archive.
    ///
    /// # Panics
    /// Panics if the index is out of range.
    pub fn evaluation(&self, index: usize) -> &Evaluation {
        &self.cache[&bits(&self.archive[index].tuners)]
    }

    /// Evaluates a point, simulating only what is not in the store.
    fn answer(&self, point: &[f64]) -> CachedPoint {
        answer(self.problem, self.store, point)
    }

    /// Records an evaluated point, and passes new results to the store.
    fn keep(&mut self, key: Vec<u64>, answer: CachedPoint) {
        let CachedPoint { mut evaluation, learned } = answer;
        self.record(&evaluation);
        evaluation.residuals = Vec::new();
        if let Some(store) = self.store {
            self.reused += usize::from(learned.is_none());
            store.answered(&evaluation.tuners, learned);
        }
        self.cache.insert(key, evaluation);
    }

    /// Notifies the observer of the progress.
    fn notify(&mut self) {
        self.watch.evaluated(&self.state());
        if let Some(best) = self.best.as_ref().filter(|_| std::mem::take(&mut self.improved)) {
            self.watch.improved(best);
        }
    }

    /// Returns values and derivatives at a point by finite differences.
    fn difference(&mut self, point: &[f64], reach: f64) -> Result<Option<Linearisation>, Halt> {
        self.needs_residuals = self.shape().residuals > 0;
        let found = Differences::of_noise(self.problem.noise()).linearise(self, point, reach);
        self.needs_residuals = false;
        found
    }

    /// Returns exact derivatives, from the store if available.
    fn slopes(&self, at: &Evaluation, reach: f64) -> Option<Slopes> {
        let Some(store) = self.store else { return self.problem.slopes(at, reach) };
        let known = store.known_slopes(&at.tuners, reach);
        let CachedGradients { slopes, learned } = self.problem.slopes_keeping(at, reach, known);
        if let Some(learned) = learned {
            store.learned_slopes(&at.tuners, reach, learned);
        }
        slopes
    }

    fn record(&mut self, evaluation: &Evaluation) {
        for (job, failure) in &evaluation.failures {
            match self.failures.iter_mut().find(|f| f.job == *job && f.first.kind() == failure.kind()) {
                Some(known) => known.count += 1,
                None => self.failures.push(FailureCount { job: *job, first: failure.clone(), count: 1 }),
            }
        }
        self.failed += usize::from(evaluation.merit.objective.is_infinite());
        let shape = self.problem.shape();
        let each = shape.objective == Objective::Each;
        let objectives = evaluation.scaled.as_ref().filter(|_| each).map(|scaled| shape.objectives(scaled));
        self.archive.push(Record {
            objectives: objectives.unwrap_or_default(),
            tuners: evaluation.tuners.clone(),
            values: evaluation.readings.iter().map(|r| r.map_or(f64::NAN, |r| r.value)).collect(),
            merit: evaluation.merit,
        });
        if self.best.as_ref().is_none_or(|best| evaluation.merit.is_better_than(&best.merit)) {
            self.best = Some(evaluation.clone());
            self.improved = true;
        }
    }

    fn state(&self) -> State {
        State {
            evaluations: self.archive.len(),
            budget: self.planned.unwrap_or(self.budget.evaluations),
            failed: self.failed,
            best: self.best.as_ref().map_or(Merit::FAILED, |b| b.merit),
        }
    }
}

/// Hash of the bits of numbers: each word is folded in by a multiplication. Resistance to attacks is not needed.
///
/// Source: the constant is that of D. E. Knuth, The Art of Computer Programming, volume 3, section 6.4.
#[derive(Debug, Clone, Copy, Default)]
struct Bits(u64);

impl Hasher for Bits {
    fn write(&mut self, bytes: &[u8]) {
        let (words, rest) = bytes.as_chunks();
        words.iter().for_each(|word| self.write_u64(u64::from_ne_bytes(*word)));
        rest.iter().for_each(|byte| self.write_u64(u64::from(*byte)));
    }

    fn write_u64(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(23) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    fn write_usize(&mut self, word: usize) {
        self.write_u64(word as u64);
    }

    /// The low bits of floating-point numbers are often zero, and so are those of their products.
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }
}

/// Evaluates a point, simulating only what is not in the store.
fn answer(problem: &impl Evaluator, store: Option<&dyn Store>, point: &[f64]) -> CachedPoint {
    match store {
        None => CachedPoint { evaluation: problem.evaluate(point), learned: None },
        Some(store) => {
            let known = store.known(&problem.tuners_at(point));
            if let (None, Some(end)) = (&known, store.closed()) {
                end.request(Halt::Interrupted);
            }
            problem.evaluate_keeping(point, known)
        }
    }
}

/// Returns the bits of the tuner values at a point: points that round to the same tuners are identical.
fn key(problem: &impl Evaluator, point: &[f64]) -> Vec<u64> {
    bits(&problem.tuners_at(point))
}

/// Returns the bits of values; minus zero, to which small negative numbers round, becomes zero.
fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| (value + 0.0).to_bits()).collect()
}

impl<E: Evaluator> Oracle for Run<'_, E> {
    fn shape(&self) -> &Shape {
        self.problem.shape()
    }

    fn evaluate(&mut self, points: &[Vec<f64>]) -> Result<Vec<Evaluation>, Halt> {
        debug_assert!(points.iter().flatten().all(|u| (0.0..=1.0).contains(u)), "solvers stay inside the unit box");
        let keys: Vec<Vec<u64>> = points.iter().map(|point| key(self.problem, point)).collect();
        let mut seen: HashSet<&[u64], BuildHasherDefault<Bits>> = HashSet::default();
        let is_new = |i: &usize| !self.cache.contains_key(&keys[*i]) && seen.insert(&keys[*i]);
        let mut new: Vec<usize> = (0..keys.len()).filter(is_new).collect();
        let left = self.budget.evaluations.saturating_sub(self.archive.len());
        let within_budget = new.len() <= left;
        new.truncate(left);
        // Small batches, so that an interrupt takes effect soon. The results are folded in order, so that neither the
        // batches nor the number of threads change a bit.
        let mut residuals: HashMap<usize, Vec<f64>> = HashMap::new();
        for batch in new.chunks(4 * rayon::current_num_threads().max(1)) {
            if self.watch.wants_stop() {
                return Err(self.watch.halt());
            }
            let (problem, store) = (self.problem, self.store);
            // Sending a single point to another thread does not pay off.
            let answers: Vec<CachedPoint> = match batch {
                [i] => vec![answer(problem, store, &points[*i])],
                _ => batch.par_iter().map(|&i| answer(problem, store, &points[i])).collect(),
            };
            let cut_off = answers.iter().position(|answer| answer.evaluation.is_cancelled());
            for (&i, answer) in batch.iter().zip(answers).take(cut_off.unwrap_or(batch.len())) {
                if !answer.evaluation.residuals.is_empty() {
                    residuals.insert(i, answer.evaluation.residuals.clone());
                }
                self.keep(keys[i].clone(), answer);
            }
            self.notify();
            if cut_off.is_some() {
                return Err(self.watch.halt());
            }
        }
        if !within_budget {
            return Err(Halt::Budget);
        }
        let whole = |(i, (point, key)): (usize, (&Vec<f64>, &Vec<u64>))| {
            let known = self.cache[key].clone();
            let residuals = match residuals.remove(&i) {
                None if self.needs_residuals && known.scaled.is_some() => self.problem.evaluate(point).residuals,
                fresh => fresh.unwrap_or_default(),
            };
            Evaluation { point: point.clone(), residuals, ..known }
        };
        Ok(points.iter().zip(&keys).enumerate().map(whole).collect())
    }

    /// Returns exact derivatives if models and criteria provide them, else finite differences.
    fn linearise(&mut self, point: &[f64], reach: f64) -> Result<Option<Linearisation>, Halt> {
        let step = Differences::of_noise(self.problem.noise()).step(reach);
        let at = self.evaluate(&[point.to_vec()])?.pop().expect("one point, one answer");
        if at.scaled.is_none() {
            return Ok(None);
        }
        if self.exact {
            if self.watch.wants_stop() {
                return Err(self.watch.halt());
            }
            // Linearisations evaluate no points, but a run that only linearises must end as well.
            if self.linearisations >= self.budget.evaluations {
                return Err(Halt::Budget);
            }
            if let Some(Slopes { rows, residuals, at: values }) = self.slopes(&at, step) {
                self.linearisations += 1;
                return Ok(Some(Linearisation { at: Evaluation { residuals: values, ..at }, rows, residuals }));
            }
        }
        self.difference(point, reach)
    }

    fn best(&self) -> Option<&Evaluation> {
        self.best.as_ref()
    }

    fn is_over(&self) -> bool {
        self.watch.wants_stop()
    }

    fn remaining(&self) -> usize {
        self.planned.unwrap_or(self.budget.evaluations).saturating_sub(self.archive.len())
    }

    fn stream(&self, label: &str) -> Stream {
        stream(self.problem.seed(), label)
    }
}
