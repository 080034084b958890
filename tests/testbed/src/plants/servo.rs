//! Position servo: DC motor with current input.

use std::f64::consts::TAU;

use super::places::angle;
use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Plant, Setup, Traits};

/// Torque constant, N m/A.
const KT: f64 = 0.052;

pub const PLANT: Plant = Plant {
    name: "servo",
    states: &[("q", "rad"), ("w", "rad/s")],
    inputs: &[("i", "A")],
    outputs: &[Output { state: 0, noise: 0.01, lsb: TAU / 4096.0 }],
    places: &[angle(0, 1, 0.0)],
    parameters: &[
        Parameter { name: "J", unit: "kg m2", nominal: 0.0021 },
        Parameter { name: "b", unit: "N m s/rad", nominal: 0.0018 },
    ],
    constants: &[("Kt", KT, "N m/A")],
    equations: "der        = { q = \"w\", w = \"J*w' = Kt*i - b*w\" }\n",
    rates: |x, u, p, w, dx| {
        dx[0] = x[1];
        dx[1] = (KT * u[0] - p[1] * x[1] + w[0]) / p[0];
    },
    setup: |draw, _| {
        let samples = 900 + draw.below(700);
        let size = draw.between(0.25, 0.6);
        let i = excitation::any(draw, samples, 0.01, (0.15, 2.0), size);
        let start = vec![draw.between(-1.0, 1.0), draw.between(-2.0, 2.0)];
        Setup { dt: 0.01, samples, start, inputs: vec![i] }
    },
    traits: Traits { linear: true, ..PLAIN },
};
