//! Places of effects in a model and a piece, by index.

use mops_core::effect::Port;
use mops_models::WithEffects;

use crate::fit::Piece;

/// Indices of a candidate's places in a model.
#[derive(Debug, Clone, Copy)]
pub enum PortIndex {
    /// Force of an equation, position, speed.
    Joint(usize, usize, usize),
    /// Force of an equation, speed.
    Speed(usize, usize),
    /// Force of an equation, state.
    Process(usize, usize),
    /// Input.
    Actuator(usize),
    /// Series of the piece.
    Sensor(usize),
}

/// Finds a port in a model and a piece; `None` for a sensor without data.
pub fn port_index(port: &Port, model: &WithEffects, piece: &Piece) -> Option<PortIndex> {
    let interface = model.model().interface();
    let states = model.model().equation_states();
    let state = |name: &str| states.iter().position(|s| s.name == name);
    let force = |name: &str| {
        let mut processes = interface.ports.iter().filter_map(|p| match p {
            Port::Process { state, .. } => Some(state),
            _ => None,
        });
        processes.position(|s| s == name)
    };
    Some(match port {
        Port::Joint { position, velocity, .. } => {
            PortIndex::Joint(force(velocity)?, state(position)?, state(velocity)?)
        }
        Port::Speed { state: name, .. } => PortIndex::Speed(force(name)?, state(name)?),
        Port::Process { state: name, .. } => PortIndex::Process(force(name)?, state(name)?),
        Port::Actuator { input } => PortIndex::Actuator(interface.inputs.iter().position(|i| i.name == *input)?),
        Port::Sensor { output } => PortIndex::Sensor(piece.series.iter().position(|s| s.name == *output)?),
    })
}
