//! Result of an analysis: a simulation or a linear system.

use mops_linear::StateSpace;
use serde::Serialize;

use crate::trace::Trace;

/// An analysis and its directional derivatives: one analysis of the same form per direction.
pub type WithTangents = (Analysis, Vec<Analysis>);

/// Result of an analysis.
#[derive(Debug, Clone)]
pub enum Analysis {
    /// A simulation.
    Time(Response),
    /// A linear system.
    Linear(StateSpace),
}

impl Analysis {
    /// Returns the simulation, if the analysis is one.
    pub fn response(&self) -> Option<&Response> {
        match self {
            Self::Time(response) => Some(response),
            Self::Linear(_) => None,
        }
    }

    /// Returns the linear system, if the analysis is one.
    pub fn linear(&self) -> Option<&StateSpace> {
        match self {
            Self::Linear(system) => Some(system),
            Self::Time(_) => None,
        }
    }

    /// Returns the trace of a signal.
    ///
    /// # Panics
    /// Panics if the analysis is not a simulation or the signal was not requested. Both are checked when the study is
    /// built.
    pub fn trace(&self, signal: &str) -> &Trace {
        self.response().and_then(|response| response.trace(signal)).expect("checked when the study is built")
    }

    /// Returns the analysis moved by `distance` along its derivative `tangent`, to first order.
    #[must_use]
    pub fn moved(&self, tangent: &Self, distance: f64) -> Self {
        match (self, tangent) {
            (Self::Time(response), Self::Time(tangent)) => Self::Time(response.moved(tangent, distance)),
            (Self::Linear(system), Self::Linear(tangent)) => Self::Linear(system.moved(tangent, distance)),
            _ => unreachable!("a derivative has the form of its analysis"),
        }
    }

    /// Returns the largest distance up to which [`Analysis::moved`] keeps the order of the instants at which signals
    /// jump or bend; NaN if instants coincide whose order changes with the parameters.
    pub fn room(&self, tangent: &Self) -> f64 {
        match (self, tangent) {
            (Self::Time(response), Self::Time(tangent)) => {
                let room = |((_, trace), (_, tangent)): (&(String, Trace), &(String, Trace))| trace.room(tangent);
                let least = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::NAN } else { a.min(b) };
                response.traces.iter().zip(&tangent.traces).map(room).fold(f64::INFINITY, least)
            }
            _ => f64::INFINITY,
        }
    }
}

/// A simulated response: one trace for every requested signal.
#[derive(Debug, Clone, Default)]
pub struct Response {
    /// Names and traces.
    pub traces: Vec<(String, Trace)>,
    /// Discrete events during the simulation (a joint stuck, a limit reached), in order of time.
    pub events: Vec<Event>,
    /// Computational work.
    pub work: Work,
}

impl Response {
    /// Returns the trace of a signal, if the signal was requested.
    pub fn trace(&self, signal: &str) -> Option<&Trace> {
        self.traces.iter().find(|(name, _)| name == signal).map(|(_, trace)| trace)
    }

    fn moved(&self, tangent: &Self, distance: f64) -> Self {
        let moved = |((name, trace), (_, tangent)): (&(String, Trace), &(String, Trace))| {
            (name.clone(), trace.moved(tangent, distance))
        };
        Self { traces: self.traces.iter().zip(&tangent.traces).map(moved).collect(), ..self.clone() }
    }
}

/// A discrete event of a simulation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Event {
    /// Time, s.
    pub time: f64,
    /// Description, such as `arm sticks`.
    pub what: String,
}

/// Computational work of a simulation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Work {
    /// Accepted steps.
    pub steps: usize,
    /// Steps rejected by the error control.
    pub rejected: usize,
    /// Evaluations of the right-hand side.
    pub derivatives: usize,
    /// Accepted steps in which rounding, not the tolerance, determined the error of at least one state.
    pub rough: usize,
}
