//! Pendulum with a motor at its bearing, 0 hanging.

use mops_math as math;

use super::places::angle;
use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Plant, Setup};

/// Inertia, kg m2.
const J: f64 = 1.0;

pub const PLANT: Plant = Plant {
    name: "driven-pendulum",
    states: &[("q", "rad"), ("w", "rad/s")],
    inputs: &[("u", "V")],
    outputs: &[Output { state: 0, noise: 0.002, lsb: 0.0 }],
    places: &[angle(0, 1, 0.0)],
    parameters: &[
        Parameter { name: "a", unit: "N m", nominal: 20.0 },
        Parameter { name: "b", unit: "N m s/rad", nominal: 1.0 },
        Parameter { name: "k", unit: "N m/V", nominal: 10.0 },
    ],
    constants: &[("J", J, "kg m2")],
    equations: "der        = { q = \"w\", w = \"J*w' = k*u - a*sin(q) - b*w\" }\n",
    rates: |x, u, p, w, dx| {
        dx[0] = x[1];
        dx[1] = (p[2] * u[0] - p[0] * math::sin(x[0]) - p[1] * x[1] + w[0]) / J;
    },
    setup: |draw, e| {
        let (dt, samples) = (0.05, excitation::length(e, 300));
        let start = vec![0.3 * draw.normal(), draw.normal()];
        let u = excitation::record(draw, e, (samples, dt), (0.08, 1.3));
        Setup { dt, samples, start, inputs: vec![excitation::scaled(&u, 0.5, 0.0, None)] }
    },
    traits: PLAIN,
};
