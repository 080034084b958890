//! Heated room with one thermal node; heat is in kW, its capacity in kJ/K.

use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Place, Plant, Setup, Traits};

pub const PLANT: Plant = Plant {
    name: "room",
    states: &[("T", "degC")],
    inputs: &[("P", "kW"), ("To", "degC")],
    outputs: &[Output { state: 0, noise: 0.05, lsb: 0.02 }],
    places: &[Place::Process { x: 0 }],
    parameters: &[
        Parameter { name: "C", unit: "kJ/K", nominal: 950.0 },
        Parameter { name: "R", unit: "K/kW", nominal: 7.0 },
        Parameter { name: "eta", unit: "1", nominal: 0.9 },
    ],
    constants: &[],
    equations: "der        = { T = \"C*T' = (To - T)/R + eta*P\" }\n",
    rates: |x, u, p, w, dx| dx[0] = ((u[1] - x[0]) / p[1] + p[2] * u[0] + w[0]) / p[0],
    setup: |draw, _| {
        let samples = 900 + draw.below(400);
        let (high, mean) = (draw.between(2.5, 4.0), draw.between(0.0, 10.0));
        let p = excitation::steps(draw, samples, 120.0, (1800.0, 14_000.0), (0.0, high));
        let to = excitation::weather(draw, samples, 120.0, mean, 5.0);
        Setup { dt: 120.0, samples, start: vec![draw.between(14.0, 24.0)], inputs: vec![p, to] }
    },
    traits: Traits { thermal: true, linear: true, ..PLAIN },
};
