//! Generates the measurements of the study `furuta-swing`.
//!
//! The device is simulated by a method that shares nothing with mops: Moreau's time stepping with steps of 10
//! microseconds. Dry friction is an impulse found by projected Gauss-Seidel sweeps.
//!
//! Sensors: white noise on both angles, an encoder with 2048 lines on the arm, a 12-bit converter over one turn on the
//! pendulum.
//!
//! Source of the method: J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, CISM 302 (1988).

use std::fmt::Write;

use mops_math as math;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Inertia of the pendulum, of the arm, coupling (kg m2) and gravity torque (N m) of the device.
pub const LUMPED: [f64; 4] = [9.035e-4, 1.133e-3, 6.31e-4, 2.5267e-2];
/// Viscous friction of arm and pendulum, N m s/rad.
pub const VISCOUS: [f64; 2] = [1.2e-4, 2.5e-5];
/// Coulomb friction of arm and pendulum, N m.
pub const COULOMB: [f64; 2] = [9.0e-4, 1.8e-4];

/// Name of the file, seed of its noise, initial state: arm and pendulum, angle and speed.
pub const RECORDINGS: [(&str, u64, [f64; 4]); 2] = [
    ("horizontal.csv", 1, [-0.0122, -0.0635, 1.6803, 1.7812]),
    ("upright.csv", 2, [-0.0851, -2.1246, -2.0698, -8.7596]),
];

const STEP: f64 = 1e-5;
const SAMPLE: f64 = 0.01;
const DURATION: f64 = 3.0;
const NOISE: f64 = 0.003;

/// Returns a recording as CSV.
pub fn recording(seed: u64, start: [f64; 4]) -> String {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut measure = |angle: f64, lines: f64| {
        let resolution = std::f64::consts::TAU / lines;
        ((angle + NOISE * math::normal(&mut random)) / resolution).round() * resolution
    };
    let mut text = String::from("t[s],phi[rad],theta[rad]\n");
    let mut state = start;
    let per_sample = (SAMPLE / STEP).round() as usize;
    for sample in 0..=(DURATION / SAMPLE).round() as usize {
        if sample > 0 {
            for _ in 0..per_sample {
                state = advance(state);
            }
        }
        let (phi, theta) = (measure(state[0], 8192.0), measure(state[2], 4096.0));
        writeln!(text, "{:.2},{phi:.6},{theta:.6}", sample as f64 * SAMPLE).expect("writing to a string succeeds");
    }
    text
}

/// Performs a step of length [`STEP`]: positions by the mean speed, speeds by the forces at mid-step and the friction
/// impulses.
fn advance([phi, v, theta, w]: [f64; 4]) -> [f64; 4] {
    let [a, b, c, d] = LUMPED;
    let half = 0.5 * STEP;
    let angle = theta + half * w;
    let (sin, cos) = math::sin_cos(angle);
    // Mass matrix in the order (arm, pendulum), and its inverse.
    let (m11, m12, m22) = (b + a * sin * sin, c * cos, a);
    let determinant = m11 * m22 - m12 * m12;
    let inverse = [[m22 / determinant, -m12 / determinant], [-m12 / determinant, m11 / determinant]];
    let force = [
        c * w * w * sin - 2.0 * a * w * v * sin * cos - VISCOUS[0] * v,
        a * v * v * sin * cos + d * sin - VISCOUS[1] * w,
    ];
    let free = [
        v + STEP * (inverse[0][0] * force[0] + inverse[0][1] * force[1]),
        w + STEP * (inverse[1][0] * force[0] + inverse[1][1] * force[1]),
    ];
    // Friction impulses: each tends to stop its joint, within its limit.
    let mut impulse = [0.0_f64; 2];
    for _ in 0..50 {
        for i in 0..2 {
            let j = 1 - i;
            let speed = free[i] + inverse[i][i] * impulse[i] + inverse[i][j] * impulse[j];
            let limit = STEP * COULOMB[i];
            impulse[i] = (impulse[i] - speed / inverse[i][i]).clamp(-limit, limit);
        }
    }
    let speed = |i: usize| free[i] + inverse[i][0] * impulse[0] + inverse[i][1] * impulse[1];
    let (v1, w1) = (speed(0), speed(1));
    [phi + half * (v + v1), v1, theta + half * (w + w1), w1]
}

/// Writes the recordings into the folder given as the argument.
#[allow(dead_code)]
fn main() -> std::io::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "studies/furuta-swing/data".into());
    for (name, seed, start) in RECORDINGS {
        std::fs::write(std::path::Path::new(&folder).join(name), recording(seed, start))?;
    }
    Ok(())
}
