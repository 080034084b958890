//! Trolley with a hanging load, driven by a force; th = 0 is hanging. The joint of the load has no friction in the
//! baseline model.

use mops_math as math;

use super::places::length;
use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Place, Plant, Setup, Traits};

/// Gravity, m/s2.
const G: f64 = 9.81;

pub const PLANT: Plant = Plant {
    name: "crane",
    states: &[("x", "m"), ("v", "m/s"), ("th", "rad"), ("w", "rad/s")],
    inputs: &[("u", "N")],
    outputs: &[Output { state: 0, noise: 0.001, lsb: 0.0 }, Output { state: 2, noise: 0.002, lsb: 0.0 }],
    places: &[length(0, 1), Place::Joint { q: 2, v: 3, rest: 0.0, angle: true, damped: false, sprung: false }],
    parameters: &[
        Parameter { name: "M", unit: "kg", nominal: 2.0 },
        Parameter { name: "m", unit: "kg", nominal: 0.7 },
        Parameter { name: "l", unit: "m", nominal: 0.6 },
        Parameter { name: "b", unit: "N s/m", nominal: 4.0 },
    ],
    constants: &[("g", G, "m/s2")],
    equations: r#"
[models.plant.equations.der]
x  = "v"
th = "w"
v  = "(M + m)*v' + m*l*w'*cos(th) - m*l*w^2*sin(th) = u - b*v"
w  = "m*l*v'*cos(th) + m*l^2*w' + m*g*l*sin(th) = 0"
"#,
    rates: |x, u, p, f, dx| {
        let [mc, m, l, b] = [p[0], p[1], p[2], p[3]];
        let (sin, cos) = math::sin_cos(x[2]);
        let (m11, m12, m22) = (mc + m, m * l * cos, m * l * l);
        let f1 = u[0] - b * x[1] + m * l * x[3] * x[3] * sin + f[0];
        let f2 = -m * G * l * sin + f[1];
        let det = m11 * m22 - m12 * m12;
        dx[0] = x[1];
        dx[1] = (m22 * f1 - m12 * f2) / det;
        dx[2] = x[3];
        dx[3] = (m11 * f2 - m12 * f1) / det;
    },
    setup: |draw, _| {
        let samples = 600 + draw.below(600);
        let size = draw.between(2.5, 6.0);
        let u = excitation::any(draw, samples, 0.01, (0.2, 1.5), size);
        let start = vec![draw.between(-0.2, 0.2), 0.0, draw.between(-0.6, 0.6), draw.between(-0.5, 0.5)];
        Setup { dt: 0.01, samples, start, inputs: vec![u] }
    },
    traits: Traits { mass: Some(1), ..PLAIN },
};
