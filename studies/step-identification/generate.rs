//! Generates the measurements of the study `step-identification`.

#[path = "../furuta-calibration/device.rs"]
mod device;

use device::Device;
use mops_math as math;

/// Pendulum without tilt, with viscous friction; the study estimates its inertias.
const DEVICE: Device = Device {
    inertia: [0.0008, 0.02],
    mass: 0.035,
    length: [0.2, 0.245],
    friction: [&[[0.0, 0.0], [1.0, 2e-3]], &[[0.0, 0.0], [1.0, 2e-4]]],
    peak: [1.0, 1.0],
    tilt: None,
    torque: |_| 0.0,
};

/// Torque over time, N m.
type Torque = fn(f64) -> f64;

/// Name of the file, seed of its noise, torque on the arm (N m).
pub const RECORDINGS: [(&str, u64, Torque); 2] = [("step.csv", 1, |_| 0.02), ("sine.csv", 2, |t| 0.02 * math::sin(t))];

/// Returns a recording as CSV, hanging at rest initially, with a noise level of 0.01 rad.
pub fn recording(seed: u64, torque: Torque) -> String {
    let hanging = [[0.0, std::f64::consts::PI, 0.0], [0.0; 3]];
    device::recording(&Device { torque, ..DEVICE }, hanging, 0.01, seed, true)
}

/// Writes the recordings into the folder given as the argument.
#[allow(dead_code)]
fn main() -> std::io::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "studies/step-identification/data".into());
    for (name, seed, torque) in RECORDINGS {
        std::fs::write(std::path::Path::new(&folder).join(name), recording(seed, torque))?;
    }
    Ok(())
}
