//! Two-mass drive: motor and load, coupled by an elastic shaft.

use super::places::angle;
use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Plant, Setup, Traits};

pub const PLANT: Plant = Plant {
    name: "drive",
    states: &[("q1", "rad"), ("w1", "rad/s"), ("q2", "rad"), ("w2", "rad/s")],
    inputs: &[("u", "N m")],
    outputs: &[Output { state: 0, noise: 0.002, lsb: 0.0 }, Output { state: 2, noise: 0.002, lsb: 0.0 }],
    places: &[angle(0, 1, 0.0), angle(2, 3, 0.0)],
    parameters: &[
        Parameter { name: "J1", unit: "kg m2", nominal: 0.012 },
        Parameter { name: "J2", unit: "kg m2", nominal: 0.03 },
        Parameter { name: "b1", unit: "N m s/rad", nominal: 0.05 },
        Parameter { name: "b2", unit: "N m s/rad", nominal: 0.03 },
        Parameter { name: "k", unit: "N m/rad", nominal: 3.0 },
        Parameter { name: "d", unit: "N m s/rad", nominal: 0.01 },
    ],
    constants: &[],
    equations: r#"let        = { shaft = "k*(q1 - q2) + d*(w1 - w2)" }
der        = { q1 = "w1", q2 = "w2", w1 = "J1*w1' = u - b1*w1 - shaft", w2 = "J2*w2' = shaft - b2*w2" }
"#,
    rates: |x, u, p, w, dx| {
        let shaft = p[4] * (x[0] - x[2]) + p[5] * (x[1] - x[3]);
        dx[0] = x[1];
        dx[1] = (u[0] - p[2] * x[1] - shaft + w[0]) / p[0];
        dx[2] = x[3];
        dx[3] = (shaft - p[3] * x[3] + w[1]) / p[1];
    },
    setup: |draw, _| {
        let samples = 600 + draw.below(600);
        let size = draw.between(0.3, 0.8);
        let u = excitation::any(draw, samples, 0.01, (0.3, 4.0), size);
        let q = draw.between(-0.5, 0.5);
        let start = vec![q, draw.between(-1.0, 1.0), q + draw.between(-0.05, 0.05), draw.between(-1.0, 1.0)];
        Setup { dt: 0.01, samples, start, inputs: vec![u] }
    },
    traits: Traits { coupling: Some(4), linear: true, ..PLAIN },
};
