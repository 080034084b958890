//! Why an analysis gave nothing.

use std::fmt;

use serde::Serialize;

/// Why an analysis gave nothing.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Failure {
    /// A state or a derivative stopped being finite at this time, s.
    Diverged(f64),
    /// The limit on steps was reached at this time, s.
    StepLimit(f64),
    /// The step size became too small for the clock at this time, s: the equations are stiff or singular there.
    StepTooSmall(f64),
    /// Events come closer and closer, or conditions never agree on whose turn it is, at this time, s; which, and the way out.
    EventsAccumulate(f64, String),
    /// Parameter values for which the model is not defined.
    Undefined(String),
    /// A criterion has no value for this response.
    Criterion(String),
    /// What is recorded takes more memory than a simulation may have, at this time, s.
    RecordLimit(f64),
    /// Whoever waits for the run asked it to end: nothing is known of the simulation.
    Cancelled,
}

impl Failure {
    /// The kind alone, to count failures by.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Diverged(_) => "diverged",
            Self::StepLimit(_) => "step limit",
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
            Self::StepLimit(t) => {
                write!(f, "took too many steps, the last at {t:.4} s: stiff equations, or too tight a tolerance")
            }
            Self::StepTooSmall(t) => write!(f, "needs steps too small for the clock at {t:.4} s"),
            Self::EventsAccumulate(t, why) => write!(f, "events accumulate at {t:.4} s: {why}"),
            Self::Undefined(what) | Self::Criterion(what) => f.write_str(what),
            Self::RecordLimit(t) => {
                write!(
                    f,
                    "records too much for memory, up to {t:.4} s: fewer steps or signals, or a shorter horizon, do"
                )
            }
            Self::Cancelled => f.write_str("ended before it was done"),
        }
    }
}
