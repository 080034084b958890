//! Chaining of two solvers.

use mops_core::{Halt, Oracle, Progress, Shape, Solver};

/// Solver that hands over to a second solver, at the best point, when the first one ends.
pub struct Chain {
    first: Box<dyn Solver>,
    second: Box<dyn Solver>,
    /// True if the second solver also runs after the first one has converged.
    unconditional: bool,
    /// True while the second solver runs.
    second_is_active: bool,
}

impl Chain {
    /// Chains two solvers; the second one runs only if the first one stalls.
    pub fn on_stall(first: Box<dyn Solver>, second: Box<dyn Solver>) -> Self {
        Self { first, second, unconditional: false, second_is_active: false }
    }

    /// Chains two solvers; the second one runs after any end of the first one.
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
