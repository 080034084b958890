//! Motor whose speed a sampled PI controller sets, with a time to compute.

use super::places::angle;
use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Plant, Sampled, Setup, Traits};

/// Inertia, kg m2.
const J: f64 = 1.0;
/// Proportional gain, V s/rad, and integral gain, V/rad, of the controller.
const KP: f64 = 0.4;
const KI: f64 = 1.0;
/// Sample time of the records, s, half of that of the controller.
const DT: f64 = 0.02;

pub const PLANT: Plant = Plant {
    name: "sampled-drive",
    states: &[("q", "rad"), ("w", "rad/s"), ("u", "V"), ("s", "rad")],
    inputs: &[("r", "rad/s")],
    outputs: &[Output { state: 0, noise: 0.002, lsb: 0.0 }],
    places: &[angle(0, 1, 0.0)],
    parameters: &[
        Parameter { name: "b", unit: "N m s/rad", nominal: 1.0 },
        Parameter { name: "k", unit: "N m/V", nominal: 10.0 },
    ],
    constants: &[("J", J, "kg m2"), ("kp", KP, "V s/rad"), ("ki", KI, "V/rad"), ("T", 2.0 * DT, "s")],
    equations: r#"der        = { q = "w", w = "J*w' = k*u - b*w" }
let        = { sum = "s + T*(r - w)" }
clocks.pi  = { every = "T", delay = "T/4", memory = { u = "V", s = "rad" }, next = { u = "kp*(r - w) + ki*sum", s = "sum" } }
"#,
    rates: |x, _, p, w, dx| {
        dx[0] = x[1];
        dx[1] = (p[1] * x[2] - p[0] * x[1] + w[0]) / J;
        dx[2] = 0.0;
        dx[3] = 0.0;
    },
    setup: |draw, e| {
        let samples = excitation::length(e, 300);
        let start = vec![0.3 * draw.normal(), 0.5 * draw.normal(), 0.0, 0.0];
        let r = excitation::record(draw, e, (samples, DT), (0.15, 1.2));
        Setup { dt: DT, samples, start, inputs: vec![excitation::scaled(&r, 2.0, 0.0, None)] }
    },
    traits: Traits {
        linear: true,
        sampled: Some(&Sampled {
            memory: 2,
            every: 2,
            delay: 0.5,
            next: |x, u, _, _, memory| {
                let sum = x[3] + 2.0 * DT * (u[0] - x[1]);
                memory[0] = KP * (u[0] - x[1]) + KI * sum;
                memory[1] = sum;
            },
        }),
        ..PLAIN
    },
};
