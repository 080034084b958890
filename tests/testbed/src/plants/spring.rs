//! Mass, spring and damper, driven by a force.

use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Place, Plant, Setup, Traits};

pub const PLANT: Plant = Plant {
    name: "spring",
    states: &[("x", "m"), ("v", "m/s")],
    inputs: &[("u", "N")],
    outputs: &[Output { state: 0, noise: 0.001, lsb: 0.0 }],
    places: &[Place::Joint { q: 0, v: 1, rest: 0.0, angle: false, damped: true, sprung: true }],
    parameters: &[
        Parameter { name: "m", unit: "kg", nominal: 1.3 },
        Parameter { name: "c", unit: "N s/m", nominal: 1.2 },
        Parameter { name: "k", unit: "N/m", nominal: 85.0 },
    ],
    constants: &[],
    equations: "der        = { x = \"v\", v = \"m*v' = u - c*v - k*x\" }\n",
    rates: |x, u, p, w, dx| {
        dx[0] = x[1];
        dx[1] = (u[0] - p[1] * x[1] - p[2] * x[0] + w[0]) / p[0];
    },
    setup: |draw, experiment| {
        let samples = 900 + draw.below(900);
        let size = draw.between(2.5, 6.0);
        let u = excitation::any(draw, samples, 0.01, (0.4, 3.0), size);
        let far = if experiment == 0 { 0.03 } else { 0.1 };
        Setup { dt: 0.01, samples, start: vec![draw.between(-far, far), draw.between(-0.3, 0.3)], inputs: vec![u] }
    },
    traits: Traits { mass: Some(0), spring: Some(2), linear: true, ..PLAIN },
};
