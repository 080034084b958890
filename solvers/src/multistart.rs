//! Multistart of a local solver.
//!
//! The first run starts from the initial guess of the study, the next ones from the best points of a sample of the box.
//! If enabled, runs from points around the best one follow until nothing changes.

use mops_core::{Evaluation, Halt, Merit, Oracle, Progress, Shape, Solver};

use crate::local_archive::LocalArchive;
use crate::start::{best_of, latin_hypercube};

/// Local solver with a list of starting points.
pub struct Multistart {
    local: Box<dyn Solver>,
    /// Solver for the initial guess of the study, if different from the local solver.
    initial_solver: Option<Box<dyn Solver>>,
    /// Solver that continues from the end of the first run.
    continuation_solver: Option<Box<dyn Solver>>,
    /// Solver that is running.
    phase: Phase,
    /// Number of starting points after the first.
    extra_starts: usize,
    /// Remaining starting points, the next one last; `None` before the first run has ended.
    queue: Option<Vec<Vec<f64>>>,
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
    /// Best merits of the completed runs, without those around the best point.
    ends: Vec<Merit>,
}

/// Solver that is running.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Initial,
    Continuation,
    Sampled,
}

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
    /// Creates a multistart of `local` from `starts` points.
    pub fn new(local: Box<dyn Solver>, starts: usize) -> Self {
        Self {
            local,
            initial_solver: None,
            continuation_solver: None,
            phase: Phase::Initial,
            extra_starts: starts.saturating_sub(1),
            queue: None,
            best: None,
            local_restarts: false,
            radii: &[0.15, 0.05],
            min_gain: 1e-3,
            restart_round: RestartRound::NONE,
            run_best: None,
            ends: Vec::new(),
        }
    }

    /// Sets a different solver for the initial guess of the study.
    #[must_use]
    pub fn with_initial_solver(self, first: Box<dyn Solver>) -> Self {
        Self { initial_solver: Some(first), ..self }
    }

    /// Sets a solver that continues from the best point of the first run, before the other starting points.
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
        Self { local_restarts: true, radii, min_gain, queue: Some(Vec::new()), ..Self::new(local, 1) }
    }

    /// Starts from given points, in their order; returns false if there are none.
    ///
    /// # Errors
    /// When the run ends: budget exhausted, or interrupted by the user.
    pub fn begin_at(&mut self, oracle: &mut dyn Oracle, mut points: Vec<Vec<f64>>) -> Result<bool, Halt> {
        points.reverse();
        let Some(first) = points.pop() else { return Ok(false) };
        self.begin(oracle, &first)?;
        self.queue = Some(points);
        Ok(true)
    }

    /// Starts the first round around the best point; returns false if there is no such point.
    ///
    /// # Errors
    /// When the run ends: budget exhausted, or interrupted by the user.
    pub fn begin_local_restarts(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        self.start_restart_round(oracle)
    }

    /// Returns true if two runs have ended within `accuracy` of the best objective, relative to its magnitude.
    pub fn optimum_is_confirmed(&self, accuracy: f64) -> bool {
        let best =
            self.ends.iter().fold(Merit::FAILED, |best, end| if end.is_better_than(&best) { *end } else { best });
        let near = |end: &&Merit| {
            end.is_feasible()
                && end.objective - best.objective <= accuracy * best.objective.abs().max(f64::MIN_POSITIVE)
        };
        self.ends.iter().filter(near).count() > 1
    }

    fn start_run(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.run_best = None;
        let initial = self.initial_solver.as_mut().filter(|_| self.phase == Phase::Initial);
        initial.unwrap_or(&mut self.local).begin(&mut LocalArchive { oracle, best: &mut self.run_best }, start)
    }

    /// Starts a round around the best point; returns false if the previous rounds brought no gain.
    fn start_restart_round(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        let Some(best) = oracle.best().map(|best| (best.point.clone(), best.merit.objective)) else { return Ok(false) };
        let (centre, objective) = best;
        let RestartRound { count, idle, objective: before } = self.restart_round;
        let gained = before.is_infinite() || objective < before - self.min_gain * before.abs();
        let idle = if gained { 0 } else { idle + 1 };
        if idle >= self.radii.len() || centre.is_empty() {
            return Ok(false);
        }
        self.restart_round = RestartRound { count: count + 1, idle, objective };
        let n = centre.len();
        let radius = self.radii[count % self.radii.len()];
        let mut random = oracle.stream(&format!("restart {count}"));
        let mut sample = latin_hypercube(2 * (n + 1), n, &mut random);
        for point in &mut sample {
            point.iter_mut().zip(&centre).for_each(|(u, c)| *u = (c + radius * (2.0 * *u - 1.0)).clamp(0.0, 1.0));
        }
        let mut starts = best_of(oracle, &sample, RestartRound::STARTS)?;
        let Some(start) = starts.pop() else { return Ok(false) };
        self.queue = Some(starts);
        self.start_run(oracle, &start)?;
        Ok(true)
    }

    fn sample(&self, oracle: &mut dyn Oracle) -> Result<Vec<Vec<f64>>, Halt> {
        let n = oracle.shape().dimension();
        if self.extra_starts == 0 || n == 0 {
            return Ok(Vec::new());
        }
        let mut random = oracle.stream("multistart");
        let sample = latin_hypercube(self.extra_starts * 5 * (n + 1), n, &mut random);
        best_of(oracle, &sample, self.extra_starts)
    }
}

impl Solver for Multistart {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        self.local.accepts(shape)
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.queue = None;
        self.best = None;
        self.phase = Phase::Initial;
        self.restart_round = RestartRound::NONE;
        self.ends.clear();
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
        if progress == Progress::Continue {
            return Ok(progress);
        }
        if self.phase == Phase::Initial
            && let Some(second) = &mut self.continuation_solver
            && let Some(start) = archive.best().map(|best| best.point.clone())
        {
            second.begin(&mut archive, &start)?;
            self.phase = Phase::Continuation;
            return Ok(Progress::Continue);
        }
        self.phase = Phase::Sampled;
        if self.restart_round.count == 0 {
            self.ends.push(self.run_best.as_ref().map_or(Merit::FAILED, |best| best.merit));
        }
        let found = oracle.best().map_or(Merit::FAILED, |best| best.merit);
        if self.best.is_none_or(|(known, _)| found.is_better_than(&known)) {
            self.best = Some((found, progress));
        }
        if self.queue.is_none() {
            self.queue = Some(self.sample(oracle)?);
        }
        match self.queue.as_mut().and_then(Vec::pop) {
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
