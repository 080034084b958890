//! Sled on a rail that a force pushes once, forth, from rest: the record is one smooth stroke.

use std::f64::consts::PI;

use mops_math as math;

use super::places::length;
use crate::plant::{Output, PLAIN, Parameter, Plant, Setup, Traits};

pub const PLANT: Plant = Plant {
    name: "sled",
    states: &[("x", "m"), ("v", "m/s")],
    inputs: &[("u", "N")],
    outputs: &[Output { state: 0, noise: 0.0005, lsb: 0.0 }],
    places: &[length(0, 1)],
    parameters: &[
        Parameter { name: "m", unit: "kg", nominal: 25.0 },
        Parameter { name: "b", unit: "N s/m", nominal: 40.0 },
    ],
    constants: &[],
    equations: "der        = { x = \"v\", v = \"m*v' = u - b*v\" }\n",
    rates: |x, u, p, w, dx| {
        dx[0] = x[1];
        dx[1] = (u[0] - p[1] * x[1] + w[0]) / p[0];
    },
    setup: |draw, _| {
        // A push of half a sine, then the sled slides on.
        let (dt, samples) = (0.004, 150);
        let (push, size) = (draw.between(0.3, 0.45), draw.between(100.0, 160.0));
        let force = |k: usize| {
            let phase = PI * k as f64 * dt / push;
            if phase < PI { (1e6 * size * math::sin(phase)).round() / 1e6 } else { 0.0 }
        };
        Setup { dt, samples, start: vec![0.0, 0.0], inputs: vec![(0..samples).map(force).collect()] }
    },
    traits: Traits { mass: Some(0), linear: true, ..PLAIN },
};
