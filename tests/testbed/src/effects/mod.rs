//! Effects: the places where each fits, and its law at a given magnitude.

mod actuator;
mod dissipative;
mod disturbance;
mod elastic;
mod fits;
mod process;
mod scene;
mod sensor;

pub use fits::{Effect, any_joint, any_place, any_sensor, processes};
pub use scene::{Family, Scene};

/// Returns all effects.
pub fn effects() -> Vec<&'static Effect> {
    [dissipative::ALL, elastic::ALL, actuator::ALL, sensor::ALL, process::ALL, disturbance::ALL]
        .iter()
        .flat_map(|group| group.iter())
        .collect()
}
