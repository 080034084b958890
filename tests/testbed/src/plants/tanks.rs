//! Two tanks, the upper one emptying into the lower one, a pump into the upper one.

use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Place, Plant, Setup, Traits};

/// Cross-sections, cm2, and gravity, cm/s2.
const A1: f64 = 95.0;
const A2: f64 = 120.0;
const G: f64 = 981.0;

pub const PLANT: Plant = Plant {
    name: "tanks",
    states: &[("h1", "cm"), ("h2", "cm")],
    inputs: &[("u", "V")],
    outputs: &[Output { state: 0, noise: 0.05, lsb: 0.02 }, Output { state: 1, noise: 0.05, lsb: 0.02 }],
    places: &[Place::Process { x: 0 }, Place::Process { x: 1 }],
    parameters: &[
        Parameter { name: "kp", unit: "cm3/s/V", nominal: 42.0 },
        Parameter { name: "a1", unit: "cm2", nominal: 0.9 },
        Parameter { name: "a2", unit: "cm2", nominal: 0.85 },
    ],
    constants: &[("A1", A1, "cm2"), ("A2", A2, "cm2"), ("g", G, "cm/s2")],
    equations: r#"let        = { q1 = "a1*sqrt(2*g*max(h1, 0))", q2 = "a2*sqrt(2*g*max(h2, 0))" }
der        = { h1 = "A1*h1' = kp*u - q1", h2 = "A2*h2' = q1 - q2" }
"#,
    rates: |x, u, p, w, dx| {
        let q1 = p[1] * (2.0 * G * x[0].max(0.0)).sqrt();
        let q2 = p[2] * (2.0 * G * x[1].max(0.0)).sqrt();
        dx[0] = (p[0] * u[0] - q1 + w[0]) / A1;
        dx[1] = (q1 - q2 + w[1]) / A2;
    },
    setup: |draw, _| {
        let samples = 700 + draw.below(500);
        let (low, high) = (draw.between(2.0, 2.8), draw.between(3.6, 4.6));
        let u = excitation::steps(draw, samples, 1.0, (30.0, 120.0), (low, high));
        let start = vec![draw.between(5.0, 15.0), draw.between(5.0, 15.0)];
        Setup { dt: 1.0, samples, start, inputs: vec![u] }
    },
    traits: Traits { levels: true, ..PLAIN },
};
