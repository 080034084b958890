//! Candidates: every effect of the catalogue at every place that it fits, and the strengths that are tried first.

use std::sync::Arc;

use mops_core::{
    Effect, Interface, Role,
    effect::{Between, EffectParameter, Placement, Port, PortKind},
};
use mops_language::Unit;
use mops_outcome::diagnosis::both_places;

use crate::records::Subject;

/// An effect at a place.
#[derive(Clone)]
pub struct Candidate {
    /// The effect.
    pub effect: Arc<dyn Effect>,
    /// Its place.
    pub port: Port,
    /// Its second place, if it needs one.
    pub companion: Option<Port>,
    /// The only experiment in which it acts, for what happens once.
    pub only: Option<usize>,
    /// Position among the candidates of a diagnosis: the same effect at the same place has the same.
    pub index: usize,
}

impl Candidate {
    /// The effect in a model, under a name of its own.
    pub fn placed(&self, name: String) -> Placement {
        let (effect, port, companion) = (Arc::clone(&self.effect), self.port.clone(), self.companion.clone());
        Placement { name, effect, port, companion }
    }

    /// Whether it is such an effect at such a place, whatever its companion and its experiment.
    pub fn is_named(&self, effect: &str, place: &str) -> bool {
        self.effect.name() == effect && self.place() == place
    }

    /// Returns the unit of a strength as results spell it; empty if the model does not determine that of its forces.
    pub fn unit(&self, strength: &EffectParameter, unit: &Unit) -> String {
        let untold = matches!(self.port, Port::Joint { unit: None, .. } | Port::Process { unit: None, .. });
        if untold && strength.dimension.output != 0 { String::new() } else { unit.to_string() }
    }

    /// Whether fits of it that have stuck are restarted at every shape: [`EffectParameter::restarts`].
    pub fn has_restarts(&self) -> bool {
        !self.effect.parameters()[0].restarts.is_empty()
    }

    /// Its place; between two places of a kind both, as `joint:a with joint:b`.
    pub fn places(&self) -> String {
        both_places(&self.place(), self.companion.as_ref().map(ToString::to_string).as_deref())
    }

    /// Its place as results spell it, `kind:name`.
    pub fn place(&self) -> String {
        self.port.to_string()
    }
}

/// Returns every effect at every place of the model, and at every signal that is measured; what happens once in every
/// calibration record.
pub fn candidates(subject: &Subject, effects: &[Arc<dyn Effect>]) -> Vec<Candidate> {
    let interface = subject.model.interface();
    let is_measured = |output: &String| subject.measurements.iter().flat_map(|m| &m.series).any(|s| s.name == *output);
    let records = subject.measurements.iter().enumerate();
    let calibration: Vec<usize> =
        records.filter(|(_, m)| m.role == Role::Calibration).map(|(index, _)| index).collect();
    let seen = |port: &Port| match port {
        Port::Sensor { output } => is_measured(output),
        _ => true,
    };
    let ports: Vec<(&Port, PortKind)> = interface
        .ports
        .iter()
        .filter(|port| seen(port))
        .filter_map(|port| port.kind(&interface.ports).map(|kind| (port, kind)))
        .collect();
    let between = effects.iter().filter_map(Between::of);
    let mut all = Vec::new();
    for effect in effects.iter().cloned().chain(between) {
        let fits = |(port, kind): (&Port, PortKind)| {
            effect.ports().contains(&kind) && is_of_quantity(effect.as_ref(), port, interface)
        };
        for (index, (port, kind)) in ports.iter().enumerate().filter(|(_, own)| fits(**own)) {
            let companions: Vec<Option<Port>> = match effect.second_port() {
                None => vec![None],
                Some(wanted) => {
                    let others = if effect.mutual() { &ports[index..] } else { &ports[..] };
                    let other = |(p, k): &&(&Port, PortKind)| {
                        *k == wanted && !(p == port && k == kind) && could_be_alike(port, p, interface)
                    };
                    others.iter().filter(other).map(|(p, _)| Some((*p).clone())).collect()
                }
            };
            for companion in companions {
                let candidate =
                    Candidate { effect: Arc::clone(&effect), port: (*port).clone(), companion, only: None, index: 0 };
                if effect.is_one_off() {
                    all.extend(calibration.iter().map(|&only| Candidate { only: Some(only), ..candidate.clone() }));
                } else {
                    all.push(candidate);
                }
            }
        }
    }
    // They act after what is declared.
    let declared = subject.model.augmented().map_or(&[][..], |(_, declared)| declared);
    all.retain(|candidate: &Candidate| {
        let mut before = declared.iter().filter(|before| before.port == candidate.port);
        before.all(|before| candidate.effect.can_follow(before.effect.as_ref()))
    });
    numbered(all)
}

/// Returns candidates with their positions.
pub fn numbered(mut all: Vec<Candidate>) -> Vec<Candidate> {
    all.iter_mut().enumerate().for_each(|(index, candidate)| candidate.index = index);
    all
}

/// Whether the state of a process may be a quantity that an effect acts on ([`Effect::quantities`]).
fn is_of_quantity(effect: &dyn Effect, port: &Port, interface: &Interface) -> bool {
    let Port::Process { state, .. } = port else { return true };
    let Some(unit) = interface.signals.iter().find(|signal| signal.name == *state).map(|signal| &signal.unit) else {
        return true;
    };
    let mut quantities = effect.quantities().iter();
    effect.quantities().is_empty()
        || !unit.is_mechanical_or_thermal()
        || quantities.any(|quantity| Unit::known(quantity).dimension() == unit.dimension())
}

/// Whether what a process takes from an input could be what its state is, such as a temperature: both have the same
/// unit. All else goes together.
fn could_be_alike(port: &Port, companion: &Port, interface: &Interface) -> bool {
    let (Port::Process { state, .. }, Port::Actuator { input }) = (port, companion) else { return true };
    let start = interface.states.iter().find(|s| s.name == *state).map(|s| &s.start);
    let state = start.and_then(|start| interface.parameters.iter().find(|p| p.variable.name == *start));
    let input = interface.inputs.iter().find(|i| i.name == *input);
    state.zip(input).is_none_or(|(state, input)| state.variable.unit == input.unit)
}
