//! Runs a local solver from several starts, one after the other: the study's own first, then the best of a sample.

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
}

impl Multistart {
    /// Runs `local` from `starts` points.
    pub fn new(local: Box<dyn Solver>, starts: usize) -> Self {
        Self { local, extra: starts.saturating_sub(1), left: None, best: None }
    }

    /// Begins the first run.
    ///
    /// # Errors
    /// The run is over.
    pub fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.left = None;
        self.best = None;
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
            None => Ok(self.best.map_or(Progress::Stalled, |(_, progress)| progress)),
        }
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
