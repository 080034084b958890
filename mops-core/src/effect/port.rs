//! Ports: places of a model where a missing effect may act.

use std::fmt;

use mops_language::Unit;

/// A place where a missing force, rate, actuator effect or sensor effect may act.
#[derive(Debug, Clone, PartialEq)]
pub enum Port {
    /// A force on a second-order coordinate, which may depend on position and speed.
    Joint {
        /// Name of the place: by default that of the position.
        name: String,
        /// State that is the position.
        position: String,
        /// State that is the rate of change of the position; the force enters its equation, before a mass matrix is
        /// solved.
        velocity: String,
        /// Unit of the force, if the model provides it.
        unit: Option<Unit>,
    },
    /// A force on a speed whose position is no state of the model, before a mass matrix is solved.
    Speed {
        /// State that is the speed.
        state: String,
        /// Unit of the force, if the model provides it.
        unit: Option<Unit>,
    },
    /// A term in the equation of a state, before a mass matrix is solved.
    Process {
        /// Name of the place: the joint or the state.
        name: String,
        /// State whose equation contains the term.
        state: String,
        /// Unit of the term, if the model provides it.
        unit: Option<Unit>,
    },
    /// Effect between an input and the plant.
    Actuator {
        /// Name of the input.
        input: String,
    },
    /// Effect between a signal and its measurement.
    Sensor {
        /// Name of the signal.
        output: String,
    },
}

/// Formats a place as `kind:name`, as in results.
impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Joint { name, .. } => write!(f, "joint:{name}"),
            Self::Speed { state, .. } => write!(f, "speed:{state}"),
            Self::Process { name, .. } => write!(f, "process:{name}"),
            Self::Actuator { input } => write!(f, "actuator:{input}"),
            Self::Sensor { output } => write!(f, "sensor:{output}"),
        }
    }
}
