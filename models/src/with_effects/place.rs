//! Places of effects in a plant.

use mops_core::effect::{Placement, Port};
use mops_core::{Interface, StudyError, Variable};

/// Place of an effect, as indices, and the indices of its parameters and initial states among the parameters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) site: Site,
    pub(super) companion: Option<Site>,
    pub(super) parameters: usize,
    pub(super) starts: Option<usize>,
}

/// Port, as indices of states, inputs, signals, and forces `w`.
#[derive(Debug, Clone, Copy)]
pub(super) enum Site {
    Joint { w: usize, position: usize, velocity: usize },
    Speed { w: usize, velocity: usize },
    Process { w: usize, state: usize },
    Actuator { input: usize },
    Sensor { signal: usize },
}

impl Site {
    /// Returns the force that acts there, if one does.
    pub(super) fn force(self) -> Option<usize> {
        match self {
            Self::Joint { w, .. } | Self::Speed { w, .. } | Self::Process { w, .. } => Some(w),
            Self::Actuator { .. } | Self::Sensor { .. } => None,
        }
    }

    /// Returns the force and the speed that it changes, where there is a speed.
    pub(super) fn speed(self) -> Option<(usize, usize)> {
        match self {
            Self::Joint { w, velocity, .. } | Self::Speed { w, velocity } => Some((w, velocity)),
            _ => None,
        }
    }

    /// Returns the place of an effect, and its second port.
    pub(super) fn of_both(
        placement: &Placement,
        interface: &Interface,
        states: &[Variable],
    ) -> Result<(Self, Option<Self>), StudyError> {
        let Placement { effect, port, companion, .. } = placement;
        let kind = |port: &Port| port.kind(&interface.ports);
        let site = |key: &str, port: &Port| {
            Self::of(port, interface, states)
                .ok_or_else(|| StudyError::new(key, format!("the model has no place {port}")))
        };
        if !kind(port).is_some_and(|kind| effect.ports().contains(&kind)) {
            let names: Vec<&str> = effect.ports().iter().map(|kind| kind.name()).collect();
            let fact = format!("`{}` does not act at {port}", effect.name());
            return Err(StudyError::new("place", fact).with_help(format!("the effect acts at: {}", names.join(", "))));
        }
        let here = site("place", port)?;
        let there = match (effect.second_port(), companion) {
            (None, None) => None,
            (Some(wanted), Some(companion)) if kind(companion) == Some(wanted) => Some(site("companion", companion)?),
            (Some(wanted), given) => {
                let (key, what) = if given.is_some() { ("companion", "another") } else { ("place", "a") };
                let fact = format!("`{}` needs {what} second place of kind {}", effect.name(), wanted.name());
                let such = interface.ports.iter().find(|port| kind(port) == Some(wanted));
                let help = such.map_or_else(
                    || format!("the model has no {}", wanted.name()),
                    |port| format!("for example companion = \"{port}\""),
                );
                return Err(StudyError::new(key, fact).with_help(help));
            }
            (None, Some(_)) => {
                let fact = format!("`{}` has no second place", effect.name());
                return Err(StudyError::new("companion", fact).with_help("remove `companion`"));
            }
        };
        Ok((here, there))
    }

    fn of(port: &Port, interface: &Interface, states: &[Variable]) -> Option<Self> {
        let state = |name: &str| states.iter().position(|s| s.name == name);
        let force = |name: &str| {
            let processes = interface.ports.iter().filter_map(|port| match port {
                Port::Process { state, .. } => Some(state),
                _ => None,
            });
            processes.into_iter().position(|state| state == name)
        };
        if !interface.ports.contains(port) {
            return None;
        }
        Some(match port {
            Port::Joint { position, velocity, .. } => {
                Self::Joint { w: force(velocity)?, position: state(position)?, velocity: state(velocity)? }
            }
            Port::Speed { state: name, .. } => Self::Speed { w: force(name)?, velocity: state(name)? },
            Port::Process { state: name, .. } => Self::Process { w: force(name)?, state: state(name)? },
            Port::Actuator { input } => {
                Self::Actuator { input: interface.inputs.iter().position(|i| i.name == *input)? }
            }
            Port::Sensor { output } => {
                Self::Sensor { signal: interface.signals.iter().position(|s| s.name == *output)? }
            }
        })
    }
}
