//! Runs a local solver from several starts, one after the other: the study's own first, then the best of a sample of the
//! box, then, if wanted, around the best point found, again and again until nothing changes.

use mops_core::{Evaluation, Halt, Merit, Oracle, Progress, Solver};

use crate::local_archive::LocalArchive;
use crate::start::{best_of, latin_hypercube};

/// A local solver with a list of starts.
pub struct Multistart {
    local: Box<dyn Solver>,
    /// What runs from the study's own start in its place.
    initial_solver: Option<Box<dyn Solver>>,
    /// What goes on from where the first run ends.
    continuation_solver: Option<Box<dyn Solver>>,
    /// Whose turn it is.
    phase: Phase,
    /// Starts after the first.
    extra_starts: usize,
    /// Starts that are left, the next one last; `None` before the first run has ended.
    queue: Option<Vec<Vec<f64>>>,
    /// How the run ended that found the best point, and what that is worth.
    best: Option<(Merit, Progress)>,
    /// Whether to go on around the best point.
    local_restarts: bool,
    /// Half the widths of the box around the best point, in turn: as many rounds may find nothing.
    radii: &'static [f64],
    /// Relative change of the objective that is something.
    min_gain: f64,
    /// Rounds around the best point that were begun, rounds in a row that found nothing, and the objective before.
    restart_round: RestartRound,
    /// The best that the present run has seen itself.
    run_best: Option<Evaluation>,
    /// The same of the runs that have ended.
    final_merits: Vec<Merit>,
}

/// Which solver runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Initial,
    Continuation,
    Sampled,
}

/// A round of restarts around the best point.
#[derive(Debug, Clone, Copy)]
struct RestartRound {
    count: usize,
    idle: usize,
    objective: f64,
}

impl RestartRound {
    const NONE: Self = Self { count: 0, idle: 0, objective: f64::INFINITY };
    /// Starts of a round.
    const STARTS: usize = 3;
}

impl Multistart {
    /// Runs `local` from `starts` points.
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
            final_merits: Vec::new(),
        }
    }

    /// Another solver begins at the study's own start.
    #[must_use]
    pub fn with_initial_solver(self, first: Box<dyn Solver>) -> Self {
        Self { initial_solver: Some(first), ..self }
    }

    /// Another solver goes on from the best point of the first run, before the other starts.
    #[must_use]
    pub fn with_continuation(self, second: Box<dyn Solver>) -> Self {
        Self { continuation_solver: Some(second), ..self }
    }

    /// Goes on around the best point until two rounds of restarts, a wide and a narrow one, improve it by less than a
    /// thousandth.
    #[must_use]
    pub fn with_local_restarts(self) -> Self {
        Self { local_restarts: true, ..self }
    }

    /// Rounds from the best point on, within these distances of it in turn, until none of them improves it by as much as
    /// `gain`, relative to its size.
    pub fn restarts_around_best(local: Box<dyn Solver>, radii: &'static [f64], min_gain: f64) -> Self {
        Self { local_restarts: true, radii, min_gain, queue: Some(Vec::new()), ..Self::new(local, 1) }
    }

    /// Begins the first run.
    ///
    /// # Errors
    /// The run is over.
    pub fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.queue = None;
        self.best = None;
        self.phase = Phase::Initial;
        self.restart_round = RestartRound::NONE;
        self.final_merits.clear();
        self.start_run(oracle, start)
    }

    /// Begins the first round around the best point; `false` where there is none.
    ///
    /// # Errors
    /// The run is over.
    pub fn begin_local_restarts(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        self.start_restart_round(oracle)
    }

    /// Whether two runs have ended within `accuracy` of the best, relative to its size.
    pub fn optimum_is_confirmed(&self, accuracy: f64) -> bool {
        let best = self
            .final_merits
            .iter()
            .fold(Merit::FAILED, |best, end| if end.is_better_than(&best) { *end } else { best });
        let near = |end: &&Merit| {
            end.is_feasible()
                && end.objective - best.objective <= accuracy * best.objective.abs().max(f64::MIN_POSITIVE)
        };
        self.final_merits.iter().filter(near).count() > 1
    }

    fn start_run(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.run_best = None;
        let initial = self.initial_solver.as_mut().filter(|_| self.phase == Phase::Initial);
        initial.unwrap_or(&mut self.local).begin(&mut LocalArchive { oracle, best: &mut self.run_best }, start)
    }

    /// An iteration of the present run, or the beginning of the next.
    ///
    /// # Errors
    /// The run is over.
    pub fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
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
        self.final_merits.push(self.run_best.as_ref().map_or(Merit::FAILED, |best| best.merit));
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

    /// Begins a round around the best point; `false` where the rounds before found nothing.
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
