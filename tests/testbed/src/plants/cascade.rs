//! Two tanks in cascade, a pump into the upper one, only the lower level measured.

use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Place, Plant, Setup, Traits};

/// Cross-section of the upper tank, cm2, gain of the pump, cm3/s/V, and gravity, cm/s2.
const A1: f64 = 100.0;
const KP: f64 = 18.0;
const G: f64 = 981.0;

pub const PLANT: Plant = Plant {
    name: "cascade",
    states: &[("h1", "cm"), ("h2", "cm")],
    inputs: &[("u", "V")],
    outputs: &[Output { state: 1, noise: 0.02, lsb: 0.0 }],
    places: &[Place::Process { x: 0 }, Place::Process { x: 1 }],
    parameters: &[
        Parameter { name: "a1", unit: "cm2", nominal: 0.18 },
        Parameter { name: "a2", unit: "cm2", nominal: 0.18 },
        Parameter { name: "A2", unit: "cm2", nominal: 100.0 },
    ],
    constants: &[("A1", A1, "cm2"), ("kp", KP, "cm3/s/V"), ("g", G, "cm/s2")],
    equations: r#"let        = { q1 = "a1*sqrt(2*g*max(h1, 0))", q2 = "a2*sqrt(2*g*max(h2, 0))" }
der        = { h1 = "A1*h1' = kp*u - q1", h2 = "A2*h2' = q1 - q2" }
"#,
    rates: |x, u, p, w, dx| {
        let q1 = p[0] * (2.0 * G * x[0].max(0.0)).sqrt();
        let q2 = p[1] * (2.0 * G * x[1].max(0.0)).sqrt();
        dx[0] = (KP * u[0] - q1 + w[0]) / A1;
        dx[1] = (q1 - q2 + w[1]) / p[2];
    },
    setup: |draw, e| {
        let (dt, samples) = (4.0, excitation::length(e, 300));
        let start = vec![draw.between(3.0, 6.0), draw.between(3.0, 6.0)];
        let u = excitation::record(draw, e, (samples, dt), (0.002, 0.02));
        Setup { dt, samples, start, inputs: vec![excitation::scaled(&u, 0.38, 1.0, Some((0.15, 2.2)))] }
    },
    traits: Traits { levels: true, unmeasured: &[(0, [4.5, 0.1, 15.0])], ..PLAIN },
};
