//! Generates the measurements of the study `furuta-discrepancy`.
//!
//! The device is the driven Furuta pendulum of the test bed without torque, with the dry friction of the test bed in
//! both bearings. Equations, integrator and friction share no code with mops. The integrator is a Runge-Kutta method of
//! order 4 with 20 steps per sample; steps end where a joint stops or breaks away.
//!
//! Sensors: white noise on both angles, an encoder with 2048 lines on the arm, a 12-bit converter over one turn on the
//! pendulum.

use std::f64::consts::TAU;
use std::fmt::Write;

use mops_testbed::{Draw, Dry, Installed, Law, Setup, Spot, outputs, plants};

/// Inertia of the pendulum, of the arm, coupling (kg m2), gravity torque (N m); viscous friction of pendulum and arm
/// (N m s/rad).
pub const DEVICE: [f64; 6] = [9.035e-4, 1.133e-3, 6.31e-4, 2.5267e-2, 2.5e-5, 1.2e-4];
/// Coulomb friction of pendulum and arm, N m; missing in the model of the study.
pub const COULOMB: [f64; 2] = [1.8e-4, 9.0e-4];
/// Standard deviation of the noise, rad.
const NOISE: f64 = 0.003;

/// Name of the file, seed of its noise, length (s), initial state: pendulum and arm, angle and speed.
pub const RECORDINGS: [(&str, u64, f64, [f64; 4]); 3] = [
    ("horizontal.csv", 1, 5.0, [1.6803, 1.7812, -0.0122, -0.0635]),
    ("pushed.csv", 2, 4.0, [3.0, -4.5, 0.2, 3.0]),
    ("upright.csv", 3, 5.0, [-2.0698, -8.7596, -0.0851, -2.1246]),
];

/// Returns a recording as CSV.
pub fn recording(seed: u64, duration: f64, start: [f64; 4]) -> String {
    let plant = plants().iter().find(|plant| plant.name == "furuta-driven").expect("the test bed has this plant");
    let samples = (100.0 * duration).round() as usize + 1;
    let setup = Setup { dt: 0.01, samples, start: start.to_vec(), inputs: vec![vec![0.0; samples]] };
    let friction = COULOMB.iter().enumerate().map(|(place, &torque)| {
        let levels = move |_: &mops_testbed::At<'_>, _: f64| Dry { slide: torque, hold: torque };
        Installed { law: Law { dry: Some(Box::new(levels)), ..Law::default() }, spot: Spot::Place(place) }
    });
    let friction: Vec<Installed> = friction.collect();
    let clean = outputs(plant, &DEVICE, &setup, 0, &friction).expect("the device stays finite");
    let mut noise = Draw::new(seed, "furuta-discrepancy");
    let mut measure = |angle: f64, lines: f64| {
        let resolution = TAU / lines;
        ((angle + NOISE * noise.normal()) / resolution).round() * resolution
    };
    let mut text = String::from("t[s],phi[rad],theta[rad]\n");
    for sample in 0..samples {
        let (phi, theta) = (measure(clean[1][sample], 8192.0), measure(clean[0][sample], 4096.0));
        writeln!(text, "{:.2},{phi:.6},{theta:.6}", sample as f64 * 0.01).expect("writing to a string succeeds");
    }
    text
}

/// Writes the recordings into the folder given as the argument.
#[allow(dead_code)]
fn main() -> std::io::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "studies/furuta-discrepancy/data".into());
    for (name, seed, duration, start) in RECORDINGS {
        std::fs::write(std::path::Path::new(&folder).join(name), recording(seed, duration, start))?;
    }
    Ok(())
}
