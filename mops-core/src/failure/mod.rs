//! Failures of an analysis.

mod panics;

pub use panics::caught;

use std::fmt;

use serde::Serialize;

/// Reason why an analysis has no result.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Failure {
    /// A state or a derivative became non-finite at this time, s.
    Diverged(f64),
    /// The maximum number of steps was reached at this time, s. The text names what limited most of the steps, and a
    /// remedy.
    StepLimit(f64, String),
    /// The step size underflowed at this time, s: the equations are stiff or singular there.
    StepTooSmall(f64),
    /// Events accumulate, or switching conditions never become consistent, at this time, s. The text names them and a
    /// remedy.
    EventsAccumulate(f64, String),
    /// The model is not defined at the parameter values.
    Undefined(String),
    /// A criterion has no value for the response.
    Criterion(String),
    /// The recorded signals exceeded the memory limit of a simulation at this time, s.
    RecordLimit(f64),
    /// The simulation was cancelled on request; its result is unknown.
    Cancelled,
}

impl Failure {
    /// Returns the kind of failure, used to count failures.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Diverged(_) => "diverged",
            Self::StepLimit(..) => "step limit",
            Self::StepTooSmall(_) => "step too small",
            Self::EventsAccumulate(..) => "events accumulate",
            Self::Undefined(_) => "model undefined",
            Self::Criterion(_) => "criterion undefined",
            Self::RecordLimit(_) => "record limit",
            Self::Cancelled => "cancelled",
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Diverged(t) => write!(f, "diverged at {t:.4} s"),
            Self::StepLimit(t, why) => write!(f, "step limit reached at t = {t:.4} s: {why}"),
            Self::StepTooSmall(t) => {
                write!(f, "step size underflow at t = {t:.4} s: the solution diverges or is very stiff")
            }
            Self::EventsAccumulate(t, why) => write!(f, "events accumulate at {t:.4} s: {why}"),
            Self::Undefined(what) | Self::Criterion(what) => f.write_str(what),
            Self::RecordLimit(t) => {
                write!(f, "memory limit reached at t = {t:.4} s: use fewer steps or signals, or a shorter horizon")
            }
            Self::Cancelled => f.write_str("cancelled before the end"),
        }
    }
}
