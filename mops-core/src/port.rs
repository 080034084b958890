//! Places of a model where an effect that it lacks may act.

use std::fmt;

use crate::unit::Unit;

/// A place where a missing force, rate, actuator or sensor effect may act.
#[derive(Debug, Clone, PartialEq)]
pub enum Port {
    /// A force on a coordinate of second order, which may depend on its position and speed.
    Joint {
        /// Name of the place: the position, where the study gives no other.
        name: String,
        /// The state that is the position.
        position: String,
        /// The state that is its rate of change; the force enters its equation, before a mass matrix is solved.
        velocity: String,
        /// Unit of the force, where the model tells it.
        unit: Option<Unit>,
    },
    /// A term in the equation of a state, before a mass matrix is solved.
    Process {
        /// Name of the place: that of the joint, or the state.
        name: String,
        /// The state whose equation it is.
        state: String,
        /// Unit of the term, where the model tells it.
        unit: Option<Unit>,
    },
    /// What an input does before it acts.
    Actuator {
        /// The input.
        input: String,
    },
    /// What a signal does before it is measured.
    Sensor {
        /// The signal.
        output: String,
    },
}

/// `kind:name`, as results spell a place.
impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Joint { name, .. } => write!(f, "joint:{name}"),
            Self::Process { name, .. } => write!(f, "process:{name}"),
            Self::Actuator { input } => write!(f, "actuator:{input}"),
            Self::Sensor { output } => write!(f, "sensor:{output}"),
        }
    }
}
