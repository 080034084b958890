//! Simple pendulum that decays, 0 hanging.

use std::f64::consts::TAU;

use mops_math as math;

use super::places::angle;
use crate::plant::{Output, PLAIN, Parameter, Plant, Setup};

/// Gravity, m/s2.
const G: f64 = 9.81;

pub const PLANT: Plant = Plant {
    name: "pendulum",
    states: &[("th", "rad"), ("w", "rad/s")],
    inputs: &[],
    outputs: &[Output { state: 0, noise: 0.002, lsb: TAU / 4096.0 }],
    places: &[angle(0, 1, 0.0)],
    parameters: &[
        Parameter { name: "L", unit: "m", nominal: 0.55 },
        Parameter { name: "b", unit: "1/s", nominal: 0.12 },
    ],
    constants: &[("g", G, "m/s2")],
    equations: "der        = { th = \"w\", w = \"w' = -(g/L)*sin(th) - b*w\" }\n",
    rates: |x, _, p, w, dx| {
        dx[0] = x[1];
        dx[1] = -G / p[0] * math::sin(x[0]) - p[1] * x[1] + w[0];
    },
    setup: |draw, _| {
        let start = vec![draw.sign() * draw.between(0.3, 2.0), draw.between(-1.0, 1.0)];
        Setup { dt: 0.01, samples: 700 + draw.below(700), start, inputs: vec![] }
    },
    traits: PLAIN,
};
