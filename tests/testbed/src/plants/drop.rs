//! Ball dropped from a bridge, y upwards, seen by a camera: the record is one smooth stroke.

use super::places::length;
use crate::plant::{Output, PLAIN, Parameter, Plant, Setup, Traits};

/// Gravity, m/s2.
const G: f64 = 9.81;

pub const PLANT: Plant = Plant {
    name: "drop",
    states: &[("y", "m"), ("v", "m/s")],
    inputs: &[],
    outputs: &[Output { state: 0, noise: 0.03, lsb: 0.0 }],
    places: &[length(0, 1)],
    parameters: &[Parameter { name: "b", unit: "1/s", nominal: 0.05 }],
    constants: &[("g", G, "m/s2")],
    equations: "der        = { y = \"v\", v = \"-g - b*v\" }\n",
    rates: |x, _, p, w, dx| {
        dx[0] = x[1];
        dx[1] = -G - p[0] * x[1] + w[0];
    },
    setup: |draw, _| {
        let start = vec![draw.between(40.0, 50.0), draw.between(-1.0, 0.0)];
        Setup { dt: 1.0 / 15.0, samples: 40 + draw.below(8), start, inputs: vec![] }
    },
    traits: Traits { linear: true, ..PLAIN },
};
