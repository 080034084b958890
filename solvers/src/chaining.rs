//! Two solvers, one after the other.

use mops_core::{Halt, Oracle, Progress, Shape, Solver};

/// A solver that goes on from the best point where another one stalls, or ends.
pub struct Chain {
    first: Box<dyn Solver>,
    second: Box<dyn Solver>,
    /// Whether the second one goes on where the first has converged too.
    unconditional: bool,
    /// Whether the second one goes on.
    second_is_active: bool,
}

impl Chain {
    /// The first, then the other.
    pub fn on_stall(first: Box<dyn Solver>, second: Box<dyn Solver>) -> Self {
        Self { first, second, unconditional: false, second_is_active: false }
    }

    /// The first to its end, however that is, then the other.
    pub fn always(first: Box<dyn Solver>, second: Box<dyn Solver>) -> Self {
        Self { unconditional: true, ..Self::on_stall(first, second) }
    }
}

impl Solver for Chain {
    fn accepts(&self, shape: &Shape) -> Result<(), String> {
        self.first.accepts(shape).and(self.second.accepts(shape))
    }

    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt> {
        self.second_is_active = false;
        self.first.begin(oracle, start)
    }

    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt> {
        if self.second_is_active {
            return self.second.step(oracle);
        }
        match self.first.step(oracle)? {
            Progress::Stalled => {}
            Progress::Converged if self.unconditional => {}
            progress => return Ok(progress),
        }
        let Some(best) = oracle.best().map(|best| best.point.clone()) else { return Ok(Progress::Stalled) };
        self.second_is_active = true;
        self.second.begin(oracle, &best)?;
        Ok(Progress::Continue)
    }
}
