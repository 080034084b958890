//! Multistart of a local solver.
//!
//! The first run starts from the initial guess of the study, the next ones from the best points of samples of the box,
//! until an optimum that is not yet known is unlikely, until the limit of evaluations without a gain is reached (see
//! [`crate::confirmation`]), or until the residuals of a calibration are noise. A run that comes close to the end of an
//! earlier one is not continued. If enabled, runs from points around the best one follow until nothing changes.

use mops_core::{
    Evaluation, Halt, Merit, Oracle, Progress, Shape, Solver,
    solver::{Basins, Optimality, SMALL_OBJECTIVE},
};

use crate::confirmation::{Confirmation, SAMPLE, factor, is_gain};
use crate::local_archive::LocalArchive;
use crate::optimality::optimality;
use crate::start::{best_of, latin_hypercube};

/// Local solver with a list of starting points.
pub struct Multistart {
    local: Box<dyn Solver>,
    /// Solver for the initial guess of the study, if different from the local solver.
    initial_solver: Option<Box<dyn Solver>>,
    /// Solver that continues from the end of the first run unless that has converged.
    continuation_solver: Option<Box<dyn Solver>>,
    /// Solver that is running.
    phase: Phase,
    /// Largest number of starting points.
    starts: usize,
    /// True if all of them are used and every run is brought to its end, whatever the ends show.
    is_thorough: bool,
    /// True if agreement of the ends confirms nothing.
    ignores_agreement: bool,
    /// Number of starting points so far.
    drawn: usize,
    /// Number of runs that have ended or were abandoned.
    runs: usize,
    /// Evaluations that the oracle allowed at the beginning of the present run.
    allowed: usize,
    /// Evaluations of the run with the last gain, up to that gain.
    to_gain: usize,
    /// Evaluations of the run that found the best point.
    cost: usize,
    /// True if the best point is shown to be stationary.
    is_stationary: bool,
    /// Evaluations up to the last gain, and since then; `None` before the beginning.
    confirmation: Option<Confirmation>,
    /// Initial guess of the study.
    initial: Vec<f64>,
    /// Remaining starting points, the next one last.
    queue: Vec<Vec<f64>>,
    /// Merit of the best point, and the result of the run that found it.
    best: Option<(Merit, Progress)>,
    /// True if runs around the best point follow.
    local_restarts: bool,
    /// Half-widths of the box around the best point, used in turn. Rounds without gain are limited to the same number.
    radii: &'static [f64],
    /// Smallest relative decrease of the objective that counts as a gain.
    min_gain: f64,
    /// Number of rounds around the best point, number of successive rounds without gain, and the last objective.
    restart_round: RestartRound,
    /// Best point of the present run.
    run_best: Option<Evaluation>,
    /// Best points of the completed runs, without those around the best point, and their merits.
    end_points: Vec<Vec<f64>>,
    ends: Vec<Merit>,
}

/// Solver that is running.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Initial,
    Continuation,
    Sampled,
}

/// Number of starting points that are drawn at once.
const AT_ONCE: usize = 2;

/// Distance along every coordinate, in the unit box, within which a run has arrived at the end of an earlier one.
const ARRIVED: f64 = 0.01;

/// Decrease of the objective, relative to the objective plus [`SMALL_OBJECTIVE`], up to which a run that is near an
/// earlier end is no better.
const NO_BETTER: f64 = 1e-6;

/// Largest cost of a run that has found nothing better, relative to that of the run that has found the best point.
const PATIENCE: f64 = 3.0;

/// Largest cost of such a run where the best point is shown to be stationary, relative to the cost up to the last gain:
/// a run needs about as much to arrive at the same optimum.
const PATIENCE_STATIONARY: f64 = 1.5;

/// Minimum number of runs before the limit of evaluations without a gain applies: three ends at one optimum are not
/// doubted.
const MIN_RUNS: usize = 3;

/// Objective that is regarded as zero. A scaled value of 1 is the demand.
pub const SMALL: f64 = 1e-6;

/// State of the rounds of restarts around the best point.
#[derive(Debug, Clone, Copy)]
struct RestartRound {
    count: usize,
    idle: usize,
    objective: f64,
}

impl RestartRound {
    const NONE: Self = Self { count: 0, idle: 0, objective: f64::INFINITY };
    /// Number of starting points per round.
    const STARTS: usize = 3;
}

impl Multistart {
    /// Creates a multistart of `local` from at most `starts` points.
    pub fn new(local: Box<dyn Solver>, starts: usize) -> Self {
        Self {
            local,
            initial_solver: None,
            continuation_solver: None,
            phase: Phase::Initial,
            starts,
            is_thorough: false,
            ignores_agreement: false,
            drawn: 0,
            runs: 0,
            allowed: 0,
            to_gain: 0,
            cost: 0,
            is_stationary: false,
            confirmation: None,
            initial: Vec::new(),
            queue: Vec::new(),
            best: None,
            local_restarts: false,
            radii: &[0.15, 0.05],
            min_gain: 1e-3,
            restart_round: RestartRound::NONE,
            run_best: None,
            end_points: Vec::new(),
            ends: Vec::new(),
        }
    }

    /// Uses all starting points, and brings every run to its end, whatever the ends show.
    #[must_use]
    pub fn thorough(self) -> Self {
        Self { is_thorough: true, ..self }
    }

    /// Sets a different solver for the initial guess of the study.
    #[must_use]
    pub fn with_initial_solver(self, first: Box<dyn Solver>) -> Self {
        Self { initial_solver: Some(first), ..self }
    }

    /// Sets a solver that continues from the best point of the first run, unless that has converged, before the other
    /// starting points.
    #[must_use]
    pub fn with_continuation(self, second: Box<dyn Solver>) -> Self {
        Self { continuation_solver: Some(second), ..self }
    }

    /// Adds restarts around the best point until two successive rounds, one wide and one narrow, improve it by less
    /// than a thousandth.
    #[must_use]
    pub fn with_local_restarts(self) -> Self {
        Self { local_restarts: true, ..self }
    }

    /// Creates rounds of restarts around the best point only, within the given distances in turn. The rounds end when
    /// none of them improves the objective by `min_gain`, relative to its magnitude.
    pub fn restarts_around_best(local: Box<dyn Solver>, radii: &'static [f64], min_gain: f64) -> Self {
        Self { local_restarts: true, radii, min_gain, ..Self::new(local, 1) }
    }

    /// Starts from given points, in their order; returns false if there are none.
    ///
    /// # Errors
    /// When the run ends: budget exhausted, or interrupted by the user.
    pub fn begin_at(&mut self, oracle: &mut dyn Oracle, mut points: Vec<Vec<f64>>) -> Result<bool, Halt> {
        points.reverse();
        let Some(first) = points.pop() else { return Ok(false) };
        self.begin(oracle, &first)?;
        self.queue = points;
        Ok(true)
    }

    /// Starts the first round around the best point; returns false if there is no such point.
    ///
    /// # Errors
    /// When the run ends: budget exhausted, or interrupted by the user.
    pub fn begin_local_restarts(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        self.phase = Phase::Sampled;
        self.confirmation = Some(Confirmation::begin(oracle));
        self.start_restart_round(oracle)
    }

    /// Returns true if two runs have converged to the best point and another optimum is unlikely.
    pub fn is_settled(&self) -> bool {
        self.best.is_some_and(|(best, progress)| {
            progress == Progress::Converged && Basins::of(best, &self.ends).is_settled()
        })
    }

    /// Returns the evaluations up to the last gain, and since then; `None` before the beginning.
    pub fn confirmation(&self) -> Option<Confirmation> {
        self.confirmation
    }

    /// Continues from the remaining starting points although the ends agree; returns false if there are none.
    ///
    /// # Errors
    /// When the run ends: budget exhausted, or interrupted by the user.
    pub fn continue_in_doubt(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        (self.ignores_agreement, self.is_stationary) = (true, false);
        let Some(start) = self.next_start(oracle)? else { return Ok(false) };
        self.start_run(oracle, &start)?;
        Ok(true)
    }

    fn start_run(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.run_best = None;
        self.allowed = oracle.remaining();
        let initial = self.initial_solver.as_mut().filter(|_| self.phase == Phase::Initial);
        initial.unwrap_or(&mut self.local).begin(&mut LocalArchive { oracle, best: &mut self.run_best }, start)
    }

    /// Returns the merit of the earlier end at which the present run has arrived.
    fn arrival(&self) -> Option<Merit> {
        let is_global = self.phase == Phase::Sampled && self.restart_round.count == 0;
        let is_global = is_global && !self.is_thorough && !self.ignores_agreement;
        let here = self.run_best.as_ref().filter(|_| is_global)?;
        let is_near = |point: &Vec<f64>| point.iter().zip(&here.point).all(|(a, b)| (a - b).abs() <= ARRIVED);
        let known = self.end_points.iter().zip(&self.ends).filter(|(point, _)| is_near(point)).map(|(_, merit)| *merit);
        known.into_iter().find(|known| {
            let is_no_better =
                known.objective - here.merit.objective <= NO_BETTER * (known.objective.abs() + SMALL_OBJECTIVE);
            known.is_feasible() && (self.is_stationary && is_no_better || !here.merit.is_better_than(known))
        })
    }

    /// Takes the end of the present run into account.
    fn record_end(&mut self, oracle: &mut dyn Oracle, progress: Progress, end: Merit) {
        if self.restart_round.count == 0 {
            self.ends.push(end);
            self.end_points.push(self.run_best.as_ref().map_or_else(Vec::new, |best| best.point.clone()));
        }
        let found = oracle.best().map_or(Merit::FAILED, |best| best.merit);
        let known = self.best.map(|(known, _)| known);
        if known.is_some_and(|known| !found.is_better_than(&known)) {
            return;
        }
        self.best = Some((found, progress));
        self.cost = self.allowed - oracle.remaining();
        let skips_test = self.is_thorough || self.ignores_agreement || self.restart_round.count > 0 || self.starts < 2;
        if !skips_test && (!self.is_stationary || known.is_none_or(|known| is_gain(&found, &known))) {
            let point = oracle.best().map_or_else(Vec::new, |best| best.point.clone());
            self.is_stationary =
                progress == Progress::Converged && optimality(oracle, &point) == Optimality::Stationary;
        }
    }

    /// Returns true if the present run has cost too much for one that has found nothing better.
    #[allow(clippy::cast_precision_loss)]
    fn is_hopeless(&self, oracle: &dyn Oracle) -> bool {
        let is_better = |here: &Evaluation| {
            let of_same_optimum = |best: &Merit| self.is_stationary && !is_gain(&here.merit, best);
            self.best.is_none_or(|(best, _)| here.merit.is_better_than(&best) && !of_same_optimum(&best))
        };
        let (patience, cost) =
            if self.is_stationary { (PATIENCE_STATIONARY, self.to_gain) } else { (PATIENCE, self.cost) };
        let cost = cost.max(SAMPLE * (oracle.shape().dimension() + 1));
        self.phase == Phase::Sampled
            && !self.is_thorough
            && !self.run_best.as_ref().is_some_and(is_better)
            && (self.allowed - oracle.remaining()) as f64 > patience * cost as f64
    }

    /// Returns true if no further starting point in the whole box is needed.
    fn is_enough(&self, oracle: &dyn Oracle) -> bool {
        let is_agreed = !self.ignores_agreement && self.is_settled();
        let optimality = if self.is_stationary { Optimality::Stationary } else { Optimality::NotShown };
        let best = self.best.map_or(Merit::FAILED, |(best, _)| best);
        let factor = factor(best, optimality, &self.ends);
        let is_limit_reached = self.confirmation.is_some_and(|confirmation| confirmation.exceeds(oracle, factor));
        !self.is_thorough && (is_agreed || self.runs >= MIN_RUNS && is_limit_reached)
    }

    /// Returns the next starting point in the whole box; `None` if there is none or no need for one.
    fn next_start(&mut self, oracle: &mut dyn Oracle) -> Result<Option<Vec<f64>>, Halt> {
        if self.restart_round.count > 0 {
            return Ok(self.queue.pop());
        }
        if self.is_enough(oracle) {
            self.queue.clear();
            return Ok(None);
        }
        // Coordinates of single experiments follow from the others: they keep their initial guess.
        let local = oracle.shape().local.clone();
        let n = oracle.shape().dimension() - local.len();
        if self.queue.is_empty() && self.drawn < self.starts && n > 0 {
            let left = self.starts - self.drawn;
            let count = if self.is_thorough || self.ignores_agreement { left } else { AT_ONCE.min(left) };
            let mut random = oracle.stream(&if self.drawn == 1 {
                "multistart".to_owned()
            } else {
                format!("multistart {}", self.drawn)
            });
            let mut sample = latin_hypercube(count * SAMPLE * (n + 1), self.initial.len(), &mut random);
            sample.iter_mut().for_each(|point| local.iter().for_each(|&j| point[j] = self.initial[j]));
            self.queue = best_of(oracle, &sample, count)?;
            self.drawn += count;
        }
        Ok(self.queue.pop())
    }

    /// Starts a round around the best point; returns false if the previous rounds brought no gain.
    fn start_restart_round(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        let Some(best) = oracle.best().map(|best| (best.point.clone(), best.merit.objective)) else { return Ok(false) };
        let (centre, objective) = best;
        let RestartRound { count, idle, objective: before } = self.restart_round;
        let gained = before.is_infinite() || objective < before - self.min_gain * before.abs().max(SMALL);
        let idle = if gained { 0 } else { idle + 1 };
        if idle >= self.radii.len() || centre.is_empty() {
            return Ok(false);
        }
        self.restart_round = RestartRound { count: count + 1, idle, objective };
        let local = oracle.shape().local.clone();
        let n = centre.len() - local.len();
        let radius = self.radii[count % self.radii.len()];
        let mut random = oracle.stream(&format!("restart {count}"));
        let mut sample = latin_hypercube(2 * (n + 1), centre.len(), &mut random);
        for point in &mut sample {
            point.iter_mut().zip(&centre).for_each(|(u, c)| *u = (c + radius * (2.0 * *u - 1.0)).clamp(0.0, 1.0));
            local.iter().for_each(|&j| point[j] = centre[j]);
        }
        let mut starts = best_of(oracle, &sample, RestartRound::STARTS)?;
        let Some(start) = starts.pop() else { return Ok(false) };
        self.queue = starts;
        self.start_run(oracle, &start)?;
        Ok(true)
    }
}

impl Solver for Multistart {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        self.local.accepts(shape)
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        (self.phase, self.restart_round, self.best) = (Phase::Initial, RestartRound::NONE, None);
        self.queue.clear();
        self.end_points.clear();
        self.ends.clear();
        (self.drawn, self.runs) = (1, 0);
        (self.ignores_agreement, self.is_stationary) = (false, false);
        self.initial = start.to_vec();
        self.confirmation = Some(Confirmation::begin(oracle));
        self.start_run(oracle, start)
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let mut archive = LocalArchive { oracle: &mut *oracle, best: &mut self.run_best };
        let solver = match self.phase {
            Phase::Initial => self.initial_solver.as_mut(),
            Phase::Continuation => self.continuation_solver.as_mut(),
            Phase::Sampled => None,
        };
        let progress = solver.unwrap_or(&mut self.local).step(&mut archive)?;
        if self.confirmation.as_mut().is_some_and(|confirmation| confirmation.observe(archive.oracle)) {
            self.to_gain = self.allowed - archive.oracle.remaining();
        }
        if progress == Progress::Continue {
            if let Some(end) = self.arrival() {
                self.record_end(oracle, Progress::Converged, end);
            } else if !self.is_hopeless(oracle) {
                return Ok(progress);
            }
        } else {
            if self.phase == Phase::Initial
                && progress == Progress::Stalled
                && let Some(second) = &mut self.continuation_solver
                && let Some(start) = archive.best().map(|best| best.point.clone())
            {
                second.begin(&mut archive, &start)?;
                self.phase = Phase::Continuation;
                return Ok(Progress::Continue);
            }
            let end = self.run_best.as_ref().map_or(Merit::FAILED, |best| best.merit);
            self.record_end(oracle, progress, end);
        }
        self.phase = Phase::Sampled;
        self.runs += 1;
        if self.best.is_some_and(|(best, progress)| {
            progress == Progress::Converged && best.is_feasible() && oracle.shape().is_noise(best.objective)
        }) {
            return Ok(Progress::Converged);
        }
        match self.next_start(oracle)? {
            Some(start) => {
                self.start_run(oracle, &start)?;
                Ok(Progress::Continue)
            }
            None if self.local_restarts && self.start_restart_round(oracle)? => Ok(Progress::Continue),
            None => Ok(self.best.map_or(Progress::Stalled, |(_, progress)| progress)),
        }
    }

    fn ends(&self) -> &[Merit] {
        &self.ends
    }
}
