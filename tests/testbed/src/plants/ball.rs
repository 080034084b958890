//! Ball thrown up or dropped, y upwards, with linear drag.

use super::places::length;
use crate::plant::{Output, PLAIN, Parameter, Plant, Setup, Traits};

/// Gravity, m/s2.
const G: f64 = 9.81;

pub const PLANT: Plant = Plant {
    name: "ball",
    states: &[("y", "m"), ("v", "m/s")],
    inputs: &[],
    outputs: &[Output { state: 0, noise: 0.003, lsb: 0.0 }],
    places: &[length(0, 1)],
    parameters: &[Parameter { name: "b", unit: "1/s", nominal: 0.15 }],
    constants: &[("g", G, "m/s2")],
    equations: "der        = { y = \"v\", v = \"-g - b*v\" }\n",
    rates: |x, _, p, w, dx| {
        dx[0] = x[1];
        dx[1] = -G - p[0] * x[1] + w[0];
    },
    setup: |draw, experiment| {
        // Thrown up in the first two experiments, dropped from a height in the last.
        let start = match experiment {
            2 => vec![draw.between(9.0, 14.0), 0.0],
            _ => vec![draw.between(1.0, 1.8), draw.between(7.0, 11.0)],
        };
        Setup { dt: 0.0025, samples: 400 + draw.below(200), start, inputs: vec![] }
    },
    traits: Traits { linear: true, ..PLAIN },
};
