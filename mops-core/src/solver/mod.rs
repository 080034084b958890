//! Interface between problem and solver: problem dimensions and the oracle for evaluations.

mod basins;
mod differences;
mod optimality;
mod oracle;
mod shape;

pub use basins::Basins;
pub use differences::Differences;
pub use optimality::{NEGLIGIBLE_DECREASE, Optimality, Pareto, SMALL_OBJECTIVE};

use schemars::JsonSchema;
use serde::Serialize;

use crate::cancellation::Halt;
use crate::evaluation::Merit;
pub use oracle::{Linearisation, Oracle};
pub use shape::Shape;

/// Why a run stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// Solver tolerance reached.
    Converged,
    /// The budget of evaluations is spent.
    Budget,
    /// The time limit is reached.
    TimeLimit,
    /// The solver could not improve any more and reached no tolerance of an optimum.
    Stalled,
    /// The user interrupted the run.
    Interrupted,
}

impl From<Halt> for Stop {
    fn from(halt: Halt) -> Self {
        match halt {
            Halt::Budget => Self::Budget,
            Halt::TimeLimit => Self::TimeLimit,
            Halt::Interrupted => Self::Interrupted,
        }
    }
}

/// Status of a solver after an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// Further iterations are possible.
    Continue,
    /// Solver tolerance reached.
    Converged,
    /// No further improvement, and no optimum certified.
    Stalled,
}

/// A solver: asks the oracle for evaluations, one iteration at a time.
///
/// Mandatory: the three methods without a default, points inside the unit box, and an immediate return when the oracle
/// returns [`Halt`]. Free: the number of points per iteration. The run keeps the best point, the solver does not.
/// Failed evaluations are results ([`crate::Evaluation::scaled`] is `None`) and rank worse than every finite one.
pub trait Solver: Send {
    /// Checks that the solver can treat such a problem.
    ///
    /// # Errors
    /// Returns one sentence: the reason, and which solver can.
    fn accepts(&self, shape: &Shape) -> Result<(), String>;

    /// Starts at `start`, a point of the unit box.
    ///
    /// # Errors
    /// Returns [`Halt`] if the run is over.
    fn begin(&mut self, oracle: &mut dyn Oracle, start: &[f64]) -> Result<(), Halt>;

    /// Performs one iteration.
    ///
    /// # Errors
    /// Returns [`Halt`] if the run is over.
    fn step(&mut self, oracle: &mut dyn Oracle) -> Result<Progress, Halt>;

    /// Returns the current members of a population-based solver; empty for other solvers.
    fn members(&self) -> &[Vec<f64>] {
        &[]
    }

    /// Returns the kinds of the solvers that a composite solver has run so far, in order of their start; empty for
    /// other solvers.
    fn methods(&self) -> &[&'static str] {
        &[]
    }

    /// Returns the merits at which local searches from different starting points have ended; empty if the solver makes
    /// none.
    fn ends(&self) -> &[Merit] {
        &[]
    }

    /// Returns the points of the Pareto front that each solve a subproblem; empty if the solver only has evaluated
    /// points.
    fn front(&self) -> Vec<Vec<f64>> {
        Vec::new()
    }
}
