//! Two masses coupled by an elastic shaft: motor and load, with the gain of the motor unknown.

use super::places::angle;
use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Plant, Setup, Traits};

/// Inertia of the motor, kg m2.
const J1: f64 = 1.0;

pub const PLANT: Plant = Plant {
    name: "two-masses",
    states: &[("q1", "rad"), ("w1", "rad/s"), ("q2", "rad"), ("w2", "rad/s")],
    inputs: &[("u", "V")],
    outputs: &[Output { state: 0, noise: 0.002, lsb: 0.0 }, Output { state: 2, noise: 0.002, lsb: 0.0 }],
    places: &[angle(0, 1, 0.0), angle(2, 3, 0.0)],
    parameters: &[
        Parameter { name: "km", unit: "N m/V", nominal: 60.0 },
        Parameter { name: "b1", unit: "N m s/rad", nominal: 1.0 },
        Parameter { name: "k", unit: "N m/rad", nominal: 200.0 },
        Parameter { name: "d", unit: "N m s/rad", nominal: 0.5 },
        Parameter { name: "J2", unit: "kg m2", nominal: 2.0 },
        Parameter { name: "b2", unit: "N m s/rad", nominal: 1.0 },
    ],
    constants: &[("J1", J1, "kg m2")],
    equations: r#"let        = { shaft = "k*(q1 - q2) + d*(w1 - w2)" }
der        = { q1 = "w1", q2 = "w2", w1 = "J1*w1' = km*u - b1*w1 - shaft", w2 = "J2*w2' = shaft - b2*w2" }
"#,
    rates: |x, u, p, w, dx| {
        let shaft = p[2] * (x[0] - x[2]) + p[3] * (x[1] - x[3]);
        dx[0] = x[1];
        dx[1] = (p[0] * u[0] - p[1] * x[1] - shaft + w[0]) / J1;
        dx[2] = x[3];
        dx[3] = (shaft - p[5] * x[3] + w[1]) / p[4];
    },
    setup: |draw, e| {
        let (dt, samples) = (0.02, excitation::length(e, 250));
        let q = 0.3 * draw.normal();
        let start = vec![q, 0.0, q + 0.02 * draw.normal(), 0.0];
        let u = excitation::record(draw, e, (samples, dt), (0.2, 4.0));
        let mean = u.iter().sum::<f64>() / u.len() as f64;
        Setup { dt, samples, start, inputs: vec![excitation::scaled(&u, 0.7, -0.7 * mean, None)] }
    },
    traits: Traits { coupling: Some(2), linear: true, ..PLAIN },
};
