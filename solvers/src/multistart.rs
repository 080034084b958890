//! Runs a local solver from several starts, one after the other: the study's own first, then the best of a sample of the
//! box, then, if wanted, around the best point found, again and again until nothing changes.

use mops_core::{Halt, Merit, Oracle, Progress, Solver};

use crate::start::{best_of, latin_hypercube};

/// A local solver with a list of starts.
pub struct Multistart {
    local: Box<dyn Solver>,
    /// Starts after the first.
    extra: usize,
    /// Starts that are left, the next one last; `None` before the first run has ended.
    left: Option<Vec<Vec<f64>>>,
    /// How the run ended that found the best point, and what that is worth.
    best: Option<(Merit, Progress)>,
    /// Whether to go on around the best point.
    restarts: bool,
    /// Rounds around the best point that were begun, rounds in a row that found nothing, and the objective before.
    round: Round,
}

/// A round of restarts around the best point.
#[derive(Debug, Clone, Copy)]
struct Round {
    begun: usize,
    idle: usize,
    objective: f64,
}

impl Round {
    const NONE: Self = Self { begun: 0, idle: 0, objective: f64::INFINITY };
    /// Starts of a round.
    const STARTS: usize = 3;
    /// Half the width of the box around the best point, wide and narrow in turn.
    const REACH: [f64; 2] = [0.15, 0.05];
    /// Rounds that may find nothing, one of each width.
    const IDLE: usize = 2;
}

impl Multistart {
    /// Runs `local` from `starts` points.
    pub fn new(local: Box<dyn Solver>, starts: usize) -> Self {
        Self { local, extra: starts.saturating_sub(1), left: None, best: None, restarts: false, round: Round::NONE }
    }

    /// Goes on around the best point until two rounds of restarts improve it by less than a thousandth.
    #[must_use]
    pub fn until_nothing_changes(self) -> Self {
        Self { restarts: true, ..self }
    }

    /// Begins the first run.
    ///
    /// # Errors
    /// The run is over.
    pub fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.left = None;
        self.best = None;
        self.round = Round::NONE;
        self.local.begin(oracle, start)
    }

    /// An iteration of the present run, or the beginning of the next.
    ///
    /// # Errors
    /// The run is over.
    pub fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let progress = self.local.step(oracle)?;
        if progress == Progress::Continue {
            return Ok(progress);
        }
        let found = oracle.best().map_or(Merit::FAILED, |best| best.merit);
        if self.best.is_none_or(|(known, _)| found.is_better_than(&known)) {
            self.best = Some((found, progress));
        }
        if self.left.is_none() {
            self.left = Some(self.sample(oracle)?);
        }
        match self.left.as_mut().and_then(Vec::pop) {
            Some(start) => {
                self.local.begin(oracle, &start)?;
                Ok(Progress::Continue)
            }
            None if self.restarts && self.begin_round(oracle)? => Ok(Progress::Continue),
            None => Ok(self.best.map_or(Progress::Stalled, |(_, progress)| progress)),
        }
    }

    /// Begins a round around the best point; `false` where the rounds before found nothing.
    fn begin_round(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        let Some(best) = oracle.best().map(|best| (best.point.clone(), best.merit.objective)) else { return Ok(false) };
        let (centre, objective) = best;
        let Round { begun, idle, objective: before } = self.round;
        let idle = if objective < before * (1.0 - 1e-3) { 0 } else { idle + 1 };
        if idle >= Round::IDLE || centre.is_empty() {
            return Ok(false);
        }
        self.round = Round { begun: begun + 1, idle, objective };
        let n = centre.len();
        let reach = Round::REACH[begun % 2];
        let mut random = oracle.stream(&format!("restart {begun}"));
        let mut sample = latin_hypercube(2 * (n + 1), n, &mut random);
        for point in &mut sample {
            point.iter_mut().zip(&centre).for_each(|(u, c)| *u = (c + reach * (2.0 * *u - 1.0)).clamp(0.0, 1.0));
        }
        let mut starts = best_of(oracle, &sample, Round::STARTS)?;
        let Some(start) = starts.pop() else { return Ok(false) };
        self.left = Some(starts);
        self.local.begin(oracle, &start)?;
        Ok(true)
    }

    fn sample(&self, oracle: &mut dyn Oracle) -> Result<Vec<Vec<f64>>, Halt> {
        let n = oracle.shape().dimension();
        if self.extra == 0 || n == 0 {
            return Ok(Vec::new());
        }
        let mut random = oracle.stream("multistart");
        let sample = latin_hypercube(self.extra * 5 * (n + 1), n, &mut random);
        best_of(oracle, &sample, self.extra)
    }
}
