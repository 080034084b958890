//! Linear axis driven by a force.

use super::places::length;
use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Plant, Setup, Traits};

/// Force per unit of command, N/N.
const K: f64 = 1.0;

pub const PLANT: Plant = Plant {
    name: "axis",
    states: &[("x", "m"), ("v", "m/s")],
    inputs: &[("u", "N")],
    outputs: &[Output { state: 0, noise: 0.002, lsb: 0.0 }],
    places: &[length(0, 1)],
    parameters: &[
        Parameter { name: "m", unit: "kg", nominal: 3.0 },
        Parameter { name: "b", unit: "N s/m", nominal: 5.0 },
    ],
    constants: &[("K", K, "N/N")],
    equations: "der        = { x = \"v\", v = \"m*v' = K*u - b*v\" }\n",
    rates: |x, u, p, w, dx| {
        dx[0] = x[1];
        dx[1] = (K * u[0] - p[1] * x[1] + w[0]) / p[0];
    },
    setup: |draw, _| {
        let samples = 1000 + draw.below(1000);
        let size = draw.between(4.0, 10.0);
        let u = excitation::any(draw, samples, 0.01, (0.15, 1.5), size);
        Setup { dt: 0.01, samples, start: vec![0.0, draw.between(-0.7, 0.7)], inputs: vec![u] }
    },
    traits: Traits { mass: Some(0), linear: true, ..PLAIN },
};
