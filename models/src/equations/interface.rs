//! Interface of a model from text: parameters, initial states, and places of effects.

use mops_core::{Parameter, StudyError, Variable, effect::Port};
use mops_language::{Unit, suggestion};
use mops_linear::OWN;

use super::definition::{self, Definition, under};
use super::graph::Op;
use super::system::System;

/// Source of the initial value of a state.
#[derive(Debug, Clone, Copy)]
pub(super) enum Start {
    /// Value of a parameter.
    Parameter(usize),
    /// Value of an expression, unless this parameter is given.
    Expression(usize),
}

/// Returns the parameters of the model, the declared ones before the initial values, and the source of each initial
/// value.
pub(super) fn parameters(d: &Definition, system: &System) -> Result<(Vec<Parameter>, Vec<Start>), StudyError> {
    let declared = |p: &definition::Settable| Parameter {
        variable: Variable {
            name: p.quantity.name.clone(),
            unit: p.quantity.unit.clone(),
            about: p.quantity.about.clone(),
        },
        default: p.default,
        range: p.range,
        infinite: false,
    };
    let mut parameters: Vec<Parameter> = d.parameters.iter().map(declared).collect();
    let mut starts = Vec::new();
    for (state, start) in d.states.iter().zip(&system.starts) {
        if let Some(Op::Parameter(index)) = start.map(|id| system.graph.op(id)) {
            starts.push(Start::Parameter(index));
            continue;
        }
        let own = state.name.trim_start_matches(OWN);
        let name = match own.split_once('[') {
            Some((family, index)) => format!("{family}0[{index}"),
            None => format!("{own}0"),
        };
        if let Some(taken) = d.parameters.iter().find(|p| p.quantity.name == name) {
            let mistake =
                StudyError::here(format!("this parameter has the name of the initial value of `{}`", state.name));
            return Err(under(&taken.quantity.path, mistake).with_help(format!(
                "write start = {{ {} = \"{name}\" }} if this is intended, or choose another name",
                state.name
            )));
        }
        if let Some((_, text)) = d.lets.iter().find(|(taken, _)| *taken == name) {
            let fact =
                format!("this definition has the name of the parameter for the initial value of `{}`", state.name);
            return Err(under(&text.path, StudyError::here(fact)).with_help("choose another name"));
        }
        let value = start.map_or(Some(0.0), |id| system.graph.constant(id));
        let about = format!("initial value of {}", state.name);
        starts.push(match value {
            Some(_) => Start::Parameter(parameters.len()),
            None => Start::Expression(parameters.len()),
        });
        parameters.push(Parameter {
            variable: Variable { name, unit: state.unit.clone(), about },
            default: Some(value.unwrap_or(f64::NAN)),
            range: [f64::NEG_INFINITY, f64::INFINITY],
            infinite: false,
        });
    }
    Ok((parameters, starts))
}

/// Returns the ports: joints, speeds without a position, equations of all continuous states but positions, inputs,
/// states and outputs. `forces` are the units of the terms in the equations of the states.
pub(super) fn ports(d: &Definition, system: &System, forces: &[Unit]) -> Result<Vec<Port>, StudyError> {
    let name = |s: usize| d.states[s].name.clone();
    let given = |position: usize| d.ports.iter().find(|(_, joint, _)| *joint == d.states[position].name);
    for (_, joint, path) in &d.ports {
        if !system.joints.iter().any(|&(position, _)| d.states[position].name == *joint) {
            let names = system.joints.iter().map(|&(position, _)| d.states[position].name.as_str());
            return Err(under(path, StudyError::here(format!("`{joint}` is not the position of a joint")))
                .with_help(suggestion(joint, names)));
        }
    }
    let mut ports = Vec::new();
    for s in 0..d.states.len() {
        if d.is_memory(s) || system.joints.iter().any(|&(position, _)| position == s) {
            continue;
        }
        let position = system.joints.iter().find(|&&(_, velocity)| velocity == s).map(|&(position, _)| position);
        let place = position.map_or_else(|| name(s), |p| given(p).map_or_else(|| name(p), |(name, ..)| name.clone()));
        let unit = Some(forces[s].clone());
        if let Some(position) = position {
            ports.push(Port::Joint {
                name: place.clone(),
                position: name(position),
                velocity: name(s),
                unit: unit.clone(),
            });
        }
        if position.is_none() && d.states[s].unit.is_speed() {
            ports.push(Port::Speed { state: name(s), unit: unit.clone() });
        }
        ports.push(Port::Process { name: place, state: name(s), unit });
    }
    ports.extend(d.inputs.iter().map(|input| Port::Actuator { input: input.name.clone() }));
    let signals = d.states.iter().chain(d.outputs.iter().map(|(output, _)| output));
    ports.extend(signals.map(|signal| Port::Sensor { output: signal.name.clone() }));
    Ok(ports)
}
