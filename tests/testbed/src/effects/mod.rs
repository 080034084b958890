//! The effects: where each fits, and what it does at a strength.

mod actuator;
mod dissipative;
mod disturbance;
mod elastic;
mod process;
mod scene;
mod sensor;

pub use scene::{Family, Scene};

use crate::law::Spot;
use crate::plant::{Place, Plant};

/// An effect that a base model may lack.
#[derive(Debug)]
pub struct Effect {
    /// Name, in kebab case.
    pub name: &'static str,
    /// Where it makes sense in a plant.
    pub fits: fn(&Plant) -> Vec<Spot>,
    /// Draws its shape at a place; `None` where there is nothing to act on. What is left open is the strength.
    pub build: fn(&Scene<'_>) -> Option<Family>,
}

/// All effects.
pub fn effects() -> Vec<&'static Effect> {
    [dissipative::ALL, elastic::ALL, actuator::ALL, sensor::ALL, process::ALL, disturbance::ALL]
        .iter()
        .flat_map(|group| group.iter())
        .collect()
}

/// The joints for which something holds.
pub fn joints(plant: &Plant, holds: impl Fn(&Place) -> bool) -> Vec<Spot> {
    let joint = |place: &Place| matches!(place, Place::Joint { .. }) && holds(place);
    (0..plant.places.len()).filter(|&j| joint(&plant.places[j])).map(Spot::Place).collect()
}

/// The states of first order.
pub fn processes(plant: &Plant) -> Vec<Spot> {
    let process = |j: &usize| matches!(plant.places[*j], Place::Process { .. });
    (0..plant.places.len()).filter(process).map(Spot::Place).collect()
}

/// All joints.
pub fn any_joint(plant: &Plant) -> Vec<Spot> {
    joints(plant, |_| true)
}

/// All equations.
pub fn any_place(plant: &Plant) -> Vec<Spot> {
    (0..plant.places.len()).map(Spot::Place).collect()
}

/// All inputs.
pub fn any_actuator(plant: &Plant) -> Vec<Spot> {
    (0..plant.inputs.len()).map(Spot::Actuator).collect()
}

/// Inputs that an actuator makes; not what the weather makes.
pub fn real_actuator(plant: &Plant) -> Vec<Spot> {
    (0..plant.inputs.len().min(1)).map(Spot::Actuator).collect()
}

/// All outputs.
pub fn any_sensor(plant: &Plant) -> Vec<Spot> {
    (0..plant.outputs.len()).map(Spot::Sensor).collect()
}
