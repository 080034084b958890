//! Two solvers, one after the other.

use mops_core::{Halt, Oracle, Progress, Shape, Solver};

/// A solver that goes on from the best point where another one stalls, or ends.
pub struct Relay {
    first: Box<dyn Solver>,
    then: Box<dyn Solver>,
    /// Whether the second one goes on where the first has converged too.
    always: bool,
    /// Whether the second one goes on.
    handed_over: bool,
}

impl Relay {
    /// The first, then the other.
    pub fn new(first: Box<dyn Solver>, then: Box<dyn Solver>) -> Self {
        Self { first, then, always: false, handed_over: false }
    }

    /// The first to its end, however that is, then the other.
    pub fn to_the_end(first: Box<dyn Solver>, then: Box<dyn Solver>) -> Self {
        Self { always: true, ..Self::new(first, then) }
    }
}

impl Solver for Relay {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        self.first.accepts(shape).and(self.then.accepts(shape))
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.handed_over = false;
        self.first.begin(oracle, start)
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        if self.handed_over {
            return self.then.step(oracle);
        }
        match self.first.step(oracle)? {
            Progress::Stalled => {}
            Progress::Converged if self.always => {}
            progress => return Ok(progress),
        }
        let Some(best) = oracle.best().map(|best| best.point.clone()) else { return Ok(Progress::Stalled) };
        self.handed_over = true;
        self.then.begin(oracle, &best)?;
        Ok(Progress::Continue)
    }
}
