//! Runs a local solver from several starts, one after the other: the study's own first, then the best of a sample of the
//! box, then, if wanted, around the best point found, again and again until nothing changes.

use mops_core::{Evaluation, Halt, Merit, Oracle, Progress, Solver};

use crate::own::Own;
use crate::start::{best_of, latin_hypercube};

/// A local solver with a list of starts.
pub struct Multistart {
    local: Box<dyn Solver>,
    /// What runs from the study's own start in its place.
    first: Option<Box<dyn Solver>>,
    /// What goes on from where the first run ends.
    second: Option<Box<dyn Solver>>,
    /// Whose turn it is.
    leg: Leg,
    /// Starts after the first.
    extra: usize,
    /// Starts that are left, the next one last; `None` before the first run has ended.
    left: Option<Vec<Vec<f64>>>,
    /// How the run ended that found the best point, and what that is worth.
    best: Option<(Merit, Progress)>,
    /// Whether to go on around the best point.
    restarts: bool,
    /// Half the widths of the box around the best point, in turn: as many rounds may find nothing.
    reach: &'static [f64],
    /// Relative change of the objective that is something.
    gain: f64,
    /// Rounds around the best point that were begun, rounds in a row that found nothing, and the objective before.
    round: Round,
    /// The best that the present run has seen itself.
    own: Option<Evaluation>,
    /// The same of the runs that have ended.
    ends: Vec<Merit>,
}

/// Which solver runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Leg {
    First,
    Second,
    Others,
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
}

impl Multistart {
    /// Runs `local` from `starts` points.
    pub fn new(local: Box<dyn Solver>, starts: usize) -> Self {
        Self {
            local,
            first: None,
            second: None,
            leg: Leg::First,
            extra: starts.saturating_sub(1),
            left: None,
            best: None,
            restarts: false,
            reach: &[0.15, 0.05],
            gain: 1e-3,
            round: Round::NONE,
            own: None,
            ends: Vec::new(),
        }
    }

    /// Another solver begins at the study's own start.
    #[must_use]
    pub fn with_first(self, first: Box<dyn Solver>) -> Self {
        Self { first: Some(first), ..self }
    }

    /// Another solver goes on from the best point of the first run, before the other starts.
    #[must_use]
    pub fn with_second(self, second: Box<dyn Solver>) -> Self {
        Self { second: Some(second), ..self }
    }

    /// Goes on around the best point until two rounds of restarts, a wide and a narrow one, improve it by less than a
    /// thousandth.
    #[must_use]
    pub fn until_nothing_changes(self) -> Self {
        Self { restarts: true, ..self }
    }

    /// Rounds from the best point on, within these distances of it in turn, until none of them improves it by as much as
    /// `gain`, relative to its size.
    pub fn around(local: Box<dyn Solver>, reach: &'static [f64], gain: f64) -> Self {
        Self { restarts: true, reach, gain, left: Some(Vec::new()), ..Self::new(local, 1) }
    }

    /// Begins the first run.
    ///
    /// # Errors
    /// The run is over.
    pub fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.left = None;
        self.best = None;
        self.leg = Leg::First;
        self.round = Round::NONE;
        self.ends.clear();
        self.begin_run(oracle, start)
    }

    /// Begins the first round around the best point; `false` where there is none.
    ///
    /// # Errors
    /// The run is over.
    pub fn begin_around(&mut self, oracle: &mut dyn Oracle) -> Result<bool, Halt> {
        self.begin_round(oracle)
    }

    /// Whether two runs have ended within `accuracy` of the best, relative to its size.
    pub fn agrees(&self, accuracy: f64) -> bool {
        let best =
            self.ends.iter().fold(Merit::FAILED, |best, end| if end.is_better_than(&best) { *end } else { best });
        let near = |end: &&Merit| {
            end.is_feasible()
                && end.objective - best.objective <= accuracy * best.objective.abs().max(f64::MIN_POSITIVE)
        };
        self.ends.iter().filter(near).count() > 1
    }

    fn begin_run(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.own = None;
        let first = self.first.as_mut().filter(|_| self.leg == Leg::First);
        first.unwrap_or(&mut self.local).begin(&mut Own { oracle, best: &mut self.own }, start)
    }

    /// An iteration of the present run, or the beginning of the next.
    ///
    /// # Errors
    /// The run is over.
    pub fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        let mut own = Own { oracle: &mut *oracle, best: &mut self.own };
        let solver = match self.leg {
            Leg::First => self.first.as_mut(),
            Leg::Second => self.second.as_mut(),
            Leg::Others => None,
        };
        let progress = solver.unwrap_or(&mut self.local).step(&mut own)?;
        if progress == Progress::Continue {
            return Ok(progress);
        }
        if self.leg == Leg::First
            && let Some(second) = &mut self.second
            && let Some(start) = own.best().map(|best| best.point.clone())
        {
            second.begin(&mut own, &start)?;
            self.leg = Leg::Second;
            return Ok(Progress::Continue);
        }
        self.leg = Leg::Others;
        self.ends.push(self.own.as_ref().map_or(Merit::FAILED, |best| best.merit));
        let found = oracle.best().map_or(Merit::FAILED, |best| best.merit);
        if self.best.is_none_or(|(known, _)| found.is_better_than(&known)) {
            self.best = Some((found, progress));
        }
        if self.left.is_none() {
            self.left = Some(self.sample(oracle)?);
        }
        match self.left.as_mut().and_then(Vec::pop) {
            Some(start) => {
                self.begin_run(oracle, &start)?;
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
        let gained = before.is_infinite() || objective < before - self.gain * before.abs();
        let idle = if gained { 0 } else { idle + 1 };
        if idle >= self.reach.len() || centre.is_empty() {
            return Ok(false);
        }
        self.round = Round { begun: begun + 1, idle, objective };
        let n = centre.len();
        let reach = self.reach[begun % self.reach.len()];
        let mut random = oracle.stream(&format!("restart {begun}"));
        let mut sample = latin_hypercube(2 * (n + 1), n, &mut random);
        for point in &mut sample {
            point.iter_mut().zip(&centre).for_each(|(u, c)| *u = (c + reach * (2.0 * *u - 1.0)).clamp(0.0, 1.0));
        }
        let mut starts = best_of(oracle, &sample, Round::STARTS)?;
        let Some(start) = starts.pop() else { return Ok(false) };
        self.left = Some(starts);
        self.begin_run(oracle, &start)?;
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
