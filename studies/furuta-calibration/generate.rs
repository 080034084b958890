//! Generates the measurements of the studies `furuta-calibration` and `furuta-calibration-2-joint`.

#[path = "device.rs"]
mod device;

use device::{Device, State};

/// Parameters of table 4.6 of the thesis.
const DEVICE: Device = Device {
    inertia: [0.001082, 0.001656],
    mass: 0.040414,
    length: [0.238454, 0.245],
    friction: [
        &[[0.0, 0.005055], [0.130807, 0.010220], [0.468552, 0.020867], [9.011384, 0.034065]],
        &[[0.0, 0.004626], [1.0, 0.003449]],
    ],
    peak: [1.000119, 1.228720],
    tilt: Some([3.81909, 0.010007]),
    torque: |_| 0.0,
};

/// Name of the file, seed of its noise, initial state.
pub const RECORDINGS: [(&str, u64, State); 2] = [
    ("horizontal.csv", 1, [[-0.002626, 1.677478, 0.0], [-0.0362232, 1.640014, 0.0]]),
    ("upright.csv", 2, [[-0.106993, -1.785922, 0.0], [-1.340885, -10.443861, 0.0]]),
];

/// Returns a recording as CSV, with a noise level of 0.003 rad.
pub fn recording(seed: u64, start: State) -> String {
    device::recording(&DEVICE, start, 0.003, seed, false)
}

/// Writes the recordings into the folders of both studies, under the folder given as the argument.
#[allow(dead_code)]
fn main() -> std::io::Result<()> {
    let studies = std::env::args().nth(1).unwrap_or_else(|| "studies".into());
    for (name, seed, start) in RECORDINGS {
        let text = recording(seed, start);
        for study in ["furuta-calibration", "furuta-calibration-2-joint"] {
            std::fs::write(std::path::Path::new(&studies).join(study).join("data").join(name), &text)?;
        }
    }
    Ok(())
}
