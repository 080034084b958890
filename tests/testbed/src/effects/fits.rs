//! Effect that a model may lack, and the places that it fits.

use super::scene::{Family, Scene};
use crate::law::Spot;
use crate::plant::{Place, Plant};

/// Effect that a baseline model may lack.
#[derive(Debug)]
pub struct Effect {
    /// Name, in kebab case.
    pub name: &'static str,
    /// Places where the effect makes sense in a plant.
    pub fits: fn(&Plant) -> Vec<Spot>,
    /// Draws its shape at a place, with a free magnitude; `None` if there is nothing to act on.
    pub build: fn(&Scene<'_>) -> Option<Family>,
}

/// Returns the joints that satisfy a condition.
pub fn joints(plant: &Plant, holds: impl Fn(&Place) -> bool) -> Vec<Spot> {
    let joint = |place: &Place| matches!(place, Place::Joint { .. }) && holds(place);
    (0..plant.places.len()).filter(|&j| joint(&plant.places[j])).map(Spot::Place).collect()
}

/// Returns the first-order states.
pub fn processes(plant: &Plant) -> Vec<Spot> {
    let process = |j: &usize| matches!(plant.places[*j], Place::Process { .. });
    (0..plant.places.len()).filter(process).map(Spot::Place).collect()
}

/// Returns all joints.
pub fn any_joint(plant: &Plant) -> Vec<Spot> {
    joints(plant, |_| true)
}

/// Returns all equations.
pub fn any_place(plant: &Plant) -> Vec<Spot> {
    (0..plant.places.len()).map(Spot::Place).collect()
}

/// Returns all inputs.
pub fn any_actuator(plant: &Plant) -> Vec<Spot> {
    (0..plant.inputs.len()).map(Spot::Actuator).collect()
}

/// Returns the inputs driven by an actuator, without those driven by the weather.
pub fn real_actuator(plant: &Plant) -> Vec<Spot> {
    (0..plant.inputs.len().min(1)).map(Spot::Actuator).collect()
}

/// Returns all outputs.
pub fn any_sensor(plant: &Plant) -> Vec<Spot> {
    (0..plant.outputs.len()).map(Spot::Sensor).collect()
}
