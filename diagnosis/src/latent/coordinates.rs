//! Coordinates on which a missing force, or a change of an input, may depend, with the places at which it acts.

use std::f64::consts::TAU;

use mops_core::effect::Port;
use mops_language::Unit;
use mops_math as math;
use mops_models::Moment;
use mops_outcome::diagnosis::Dependence;

use crate::estimation::Estimation;
use crate::motion::{PortIndex, Trajectory, port_index};

/// Coordinate with the places at which the force over it acts.
pub struct Coordinate {
    /// Names and units, without gain and curve.
    pub names: Dependence,
    /// Its value.
    pub value: Value,
    /// Columns of the linear system with the size of a weight of 1; a force between two places acts on the second last.
    pub acts: Vec<(usize, f64)>,
    /// Sign that a positive force has in its column.
    pub sign: f64,
}

/// Value of a coordinate at an instant.
pub enum Value {
    /// A state of the equations.
    State(usize),
    /// Difference of two states.
    Difference(usize, usize),
    /// State modulo one turn, rad.
    Angle(usize),
    /// An input.
    Input(usize),
    /// Delayed input, by its index and its name, with the delay from one copy to the next, s.
    Delayed(String, f64),
}

impl Value {
    /// Returns true if the value is one of the motion at its place, and not one of an input.
    pub fn is_local(&self) -> bool {
        matches!(self, Self::State(_) | Self::Angle(_))
    }

    /// Returns the value at a moment; 0 for a delayed input, which needs the past.
    pub fn at(&self, moment: &Moment) -> f64 {
        match *self {
            Self::State(k) => moment.x[k],
            Self::Difference(a, b) => moment.x[a] - moment.x[b],
            Self::Angle(k) => moment.x[k].rem_euclid(TAU),
            Self::Input(k) => moment.u[k],
            Self::Delayed(..) => 0.0,
        }
    }
}

/// Returns all coordinates of the model of an estimation, along motions of the records of its fit.
pub fn coordinates(estimation: &Estimation<'_>, trajectories: &[Trajectory]) -> Vec<Coordinate> {
    let interface = estimation.model.model().interface();
    let states = estimation.model.model().equation_states();
    let (inputs, Some(piece)) = (interface.inputs.len(), estimation.fit.pieces.first()) else { return Vec::new() };
    let mut all = Vec::new();
    // Joints, speeds and stores: place, force, and the states over which it acts.
    let (mut joints, mut speeds, mut stores) = (Vec::new(), Vec::new(), Vec::new());
    for port in &interface.ports {
        match port_index(port, estimation.model, piece) {
            Some(PortIndex::Joint(force, position, speed)) => joints.push((port, force, position, speed)),
            Some(PortIndex::Speed(force, speed)) => speeds.push((port, force, speed)),
            Some(PortIndex::Process(force, state)) => stores.push((port, force, state)),
            Some(PortIndex::Actuator(input)) => {
                let values = || trajectories.iter().flat_map(|t| &t.moments).map(|m| m.u[input]);
                let amplitude = deviation(values());
                if amplitude > 0.0 {
                    let unit = &interface.inputs[input].unit;
                    let own = names("input", port, None, unit, Some(unit));
                    all.push(Coordinate {
                        names: own,
                        value: Value::Input(input),
                        acts: vec![(input, amplitude)],
                        sign: 1.0,
                    });
                    let delayed = names("delayed input", port, None, &Unit::known("s"), Some(&Unit::one()));
                    let value =
                        Value::Delayed(interface.inputs[input].name.clone(), estimation.channels.shortest_step());
                    all.push(Coordinate { names: delayed, value, acts: vec![(input, 1.0)], sign: 1.0 });
                }
            }
            _ => {}
        }
    }
    let mobilities = trajectories.first().map_or(&[][..], |t| &t.mobilities);
    let nominal = |force: usize| (estimation.nominal[force] / mobilities[force]).abs();
    let own = |force: usize| vec![(inputs + force, nominal(force))];
    let sign = |force: usize| trajectories.first().map_or(1.0, |t| t.forward[force]);
    let is_angle = |state: usize| states[state].unit == Unit::known("rad");
    for (port, force, position, speed) in &joints {
        let mut add = |what: &str, state: usize, value| {
            let names = names(what, port, None, &states[state].unit, force_unit(port));
            all.push(Coordinate { names, value, acts: own(*force), sign: sign(*force) });
        };
        add("speed", *speed, Value::State(*speed));
        add("position", *position, Value::State(*position));
        if is_angle(*position) {
            add("position modulo one turn", *position, Value::Angle(*position));
        }
    }
    for (port, force, speed) in &speeds {
        let names = names("speed", port, None, &states[*speed].unit, force_unit(port));
        all.push(Coordinate { names, value: Value::State(*speed), acts: own(*force), sign: sign(*force) });
    }
    let is_force = |force: usize| joints.iter().any(|joint| joint.1 == force) || speeds.iter().any(|s| s.1 == force);
    for (port, force, state) in stores.iter().filter(|store| !is_force(store.1)) {
        let names = names("level", port, None, &states[*state].unit, force_unit(port));
        all.push(Coordinate { names, value: Value::State(*state), acts: own(*force), sign: sign(*force) });
    }
    // Between two places of a kind the force acts on one and back on the other.
    let between = |a: usize, b: usize| {
        let nominal = nominal(a).min(nominal(b));
        vec![(inputs + a, -nominal), (inputs + b, nominal)]
    };
    for (k, (port, force, position, speed)) in joints.iter().enumerate() {
        for (other, other_force, other_position, other_speed) in &joints[k + 1..] {
            if states[*position].unit != states[*other_position].unit || same_unit(port, other) == Some(false) {
                continue;
            }
            let mut add = |what: &str, state: usize, value| {
                let names = names(what, port, Some(other), &states[state].unit, force_unit(port));
                all.push(Coordinate { names, value, acts: between(*force, *other_force), sign: sign(*other_force) });
            };
            add("deflection", *position, Value::Difference(*position, *other_position));
            add("rate of deflection", *speed, Value::Difference(*speed, *other_speed));
        }
    }
    let stores: Vec<_> = stores.iter().filter(|store| !is_force(store.1)).collect();
    for (port, force, state) in &stores {
        for (other, other_force, other_state) in stores.iter().filter(|other| other.1 != *force) {
            if states[*state].unit == states[*other_state].unit && same_unit(port, other) != Some(false) {
                let names = names("level", port, Some(other), &states[*state].unit, force_unit(port));
                all.push(Coordinate {
                    names,
                    value: Value::State(*state),
                    acts: between(*force, *other_force),
                    sign: sign(*other_force),
                });
            }
        }
    }
    all
}

/// Returns the names and units of a coordinate.
fn names(what: &str, place: &Port, other: Option<&Port>, unit: &Unit, signal_unit: Option<&Unit>) -> Dependence {
    Dependence {
        coordinate: what.to_owned(),
        place: place.to_string(),
        other: other.map(ToString::to_string),
        gain: 0.0,
        unit: unit.to_string(),
        signal_unit: signal_unit.map(ToString::to_string).unwrap_or_default(),
        curve: Vec::new(),
    }
}

/// Returns the unit of the force at a place, if the model determines it.
fn force_unit(port: &Port) -> Option<&Unit> {
    match port {
        Port::Joint { unit, .. } | Port::Speed { unit, .. } | Port::Process { unit, .. } => unit.as_ref(),
        _ => None,
    }
}

/// Returns whether the forces at two places have one unit, if both are known.
fn same_unit(a: &Port, b: &Port) -> Option<bool> {
    Some(force_unit(a)? == force_unit(b)?)
}

#[allow(clippy::cast_precision_loss)]
fn deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    (values.map(|v| math::powi(v - mean, 2)).sum::<f64>() / count).sqrt()
}
