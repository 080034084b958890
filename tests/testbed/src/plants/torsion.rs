//! Disc on a torsion wire, released. No friction in the baseline model.

use crate::plant::{Output, PLAIN, Parameter, Place, Plant, Setup, Traits};

/// Inertia of the disc, kg m2.
const J: f64 = 0.02;

pub const PLANT: Plant = Plant {
    name: "torsion",
    states: &[("q", "rad"), ("w", "rad/s")],
    inputs: &[],
    outputs: &[Output { state: 0, noise: 0.002, lsb: 0.002 }],
    places: &[Place::Joint { q: 0, v: 1, rest: 0.0, angle: true, damped: false, sprung: true }],
    parameters: &[Parameter { name: "k", unit: "N m/rad", nominal: 0.5 }],
    constants: &[("J", J, "kg m2")],
    equations: "der        = { q = \"w\", w = \"J*w' = -k*q\" }\n",
    rates: |x, _, p, w, dx| {
        dx[0] = x[1];
        dx[1] = (w[0] - p[0] * x[0]) / J;
    },
    setup: |draw, _| {
        let start = vec![draw.sign() * draw.between(0.4, 2.0), draw.between(-2.0, 2.0)];
        Setup { dt: 0.01, samples: 600 + draw.below(800), start, inputs: vec![] }
    },
    traits: Traits { spring: Some(0), linear: true, ..PLAIN },
};
