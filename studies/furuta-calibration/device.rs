//! Simulated Furuta pendulum, the device of the shipped measurements. It shares no model and no method with mops.
//!
//! The pendulum is a point at its centre of mass with a direction. Let `p` be the point and `n` the unit vector along
//! the rod. D'Alembert's principle for `m p''` and `J n''` gives mass matrix and forces from the joint axes. (A rod
//! without inertia about its own axis has the kinetic energy `m |p'|^2/2 + J |n'|^2/2`.)
//!
//! Moreau's time stepping with steps of 20 microseconds and midpoint forces: friction is an impulse within its limit,
//! found by projected Gauss-Seidel sweeps.
//!
//! Source of the method: J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, CISM 302 (1988).

use std::fmt::Write;

use mops_math as math;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Pendulum on an arm.
pub struct Device {
    /// Inertia of the pendulum about its centre of mass, and of the arm about its axis, kg m2.
    pub inertia: [f64; 2],
    /// Mass of the pendulum, kg.
    pub mass: f64,
    /// Distance of the pendulum's centre of mass from the arm, and length of the arm, m.
    pub length: [f64; 2],
    /// Friction torque (N m) over speed (rad/s) of arm and pendulum.
    pub friction: [&'static [[f64; 2]]; 2],
    /// Break-away torque over friction at rest.
    pub peak: [f64; 2],
    /// Spring (N m/rad) and damper (N m s/rad) against the tilt; `None` for a pendulum that does not tilt.
    pub tilt: Option<[f64; 2]>,
    /// Torque on the arm over time, N m.
    pub torque: fn(f64) -> f64,
}

/// Angles and speeds of arm, pendulum and tilt.
pub type State = [[f64; 3]; 2];

const STEP: f64 = 2e-5;
const GRAVITY: f64 = 9.81;

/// Returns a recording as CSV: 3 s at 100 Hz, both angles with white noise; with `torque`, also the torque.
pub fn recording(device: &Device, start: State, noise: f64, seed: u64, torque: bool) -> String {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut text =
        String::from(if torque { "t[s],u[N m],phi[rad],theta[rad]\n" } else { "t[s],phi[rad],theta[rad]\n" });
    let mut state = start;
    for sample in 0..=300_u32 {
        let time = f64::from(sample) * 0.01;
        let phi = state[0][0] + noise * math::normal(&mut random);
        let theta = state[0][1] + noise * math::normal(&mut random);
        let line = if torque {
            writeln!(text, "{time:.2},{:.6},{phi:.6},{theta:.6}", (device.torque)(time))
        } else {
            writeln!(text, "{time:.2},{phi:.6},{theta:.6}")
        };
        line.expect("writing to a string succeeds");
        // Zero-order hold of the torque.
        for _ in 0..500 {
            state = device.advance(time, state);
        }
    }
    text
}

impl Device {
    /// Performs one step: positions by the mean speed, speeds by the forces at mid-step and the friction impulses.
    fn advance(&self, t: f64, [q, w]: State) -> State {
        let middle = plus(q, times(0.5 * STEP, w));
        let mut mean = w;
        let mut next = w;
        // The first pass estimates the speeds at mid-step.
        for _ in 0..2 {
            let (matrix, mut force) = self.mass_and_force(middle, mean);
            force[0] += (self.torque)(t);
            let inverse = inverse(matrix);
            let free: Vector = std::array::from_fn(|i| w[i] + STEP * dot(inverse[i], force));
            next = self.slowed(inverse, free, w, mean);
            mean = times(0.5, plus(w, next));
        }
        [plus(q, times(0.5 * STEP, plus(w, next))), next]
    }

    /// Returns the speeds after friction: each impulse tends to stop its joint, within its limit.
    fn slowed(&self, inverse: [Vector; 3], free: Vector, before: Vector, mean: Vector) -> Vector {
        let torque = |i: usize| interpolated(self.friction[i], mean[i].abs());
        let limit = |i: usize| STEP * if before[i] == 0.0 { self.peak[i] * self.friction[i][0][1] } else { torque(i) };
        let limits = [limit(0), limit(1)];
        let mut impulse = [0.0; 3];
        for _ in 0..40 {
            for i in 0..2 {
                let speed = free[i] + dot(inverse[i], impulse);
                impulse[i] = if limits[i] < 0.0 {
                    // Negative friction accelerates the joint.
                    -limits[i] * mean[i].signum()
                } else {
                    (impulse[i] - speed / inverse[i][i]).clamp(-limits[i], limits[i])
                };
            }
        }
        std::array::from_fn(|i| {
            let stuck = i < 2 && impulse[i].abs() < limits[i];
            if stuck { 0.0 } else { free[i] + dot(inverse[i], impulse) }
        })
    }

    /// Returns the mass matrix and the torques without friction.
    fn mass_and_force(&self, q: Vector, w: Vector) -> ([Vector; 3], Vector) {
        let [[sf, cf], [st, ct], [sp, cp]] = q.map(|angle| [math::sin(angle), math::cos(angle)]);
        let about_vertical = |[x, y, z]: Vector| [x * cf + z * sf, y, z * cf - x * sf];
        let axes = [[0.0, 1.0, 0.0], [cf, 0.0, -sf], about_vertical([0.0, -st, ct])];
        let rod = about_vertical([-sp, cp * ct, cp * st]);
        let end = times(-self.length[1], axes[1]);
        // Derivatives of the end of the arm and of the direction of the rod with respect to each joint.
        let end_by = [cross(axes[0], end), [0.0; 3], [0.0; 3]];
        let rod_by = axes.map(|axis| cross(axis, rod));
        let point_by: [Vector; 3] = std::array::from_fn(|i| plus(end_by[i], times(self.length[0], rod_by[i])));
        // Accelerations at constant joint speeds.
        let turning = [times(w[0], axes[0]), times(w[1], axes[1]), times(w[2], axes[2])];
        let arm_and_swing = plus(turning[0], turning[1]);
        let spin = plus(arm_and_swing, turning[2]);
        let gyration = plus(cross(turning[0], turning[1]), cross(arm_and_swing, turning[2]));
        let rod_bias = plus(cross(gyration, rod), cross(spin, cross(spin, rod)));
        let point_bias = plus(cross(turning[0], cross(turning[0], end)), times(self.length[0], rod_bias));
        let load = times(self.mass, plus(point_bias, [0.0, GRAVITY, 0.0]));
        let mut matrix: [Vector; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                self.mass * dot(point_by[i], point_by[j]) + self.inertia[0] * dot(rod_by[i], rod_by[j])
            })
        });
        matrix[0][0] += self.inertia[1];
        let mut force: Vector =
            std::array::from_fn(|i| -dot(point_by[i], load) - self.inertia[0] * dot(rod_by[i], rod_bias));
        match self.tilt {
            Some([spring, damper]) => force[2] -= spring * q[2] + damper * w[2],
            None => {
                for i in 0..2 {
                    matrix[i][2] = 0.0;
                    matrix[2][i] = 0.0;
                }
                force[2] = 0.0;
            }
        }
        (matrix, force)
    }
}

/// Interpolates a table linearly, and extrapolates from its last two entries.
fn interpolated(table: &[[f64; 2]], x: f64) -> f64 {
    let last = table.len() - 2;
    let k = (0..last).find(|&k| x < table[k + 1][0]).unwrap_or(last);
    let ([x0, y0], [x1, y1]) = (table[k], table[k + 1]);
    y0 + (x - x0) * (y1 - y0) / (x1 - x0)
}

type Vector = [f64; 3];

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn plus(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn times(factor: f64, a: Vector) -> Vector {
    a.map(|x| factor * x)
}

/// Returns the inverse of a symmetric matrix, by its adjugate.
fn inverse([a, b, c]: [Vector; 3]) -> [Vector; 3] {
    let rows = [cross(b, c), cross(c, a), cross(a, b)];
    let determinant = dot(a, rows[0]);
    // Symmetric: the rows of the adjugate are its columns.
    rows.map(|row| times(1.0 / determinant, row))
}
