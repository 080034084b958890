//! Stirred tank heated through a jacket, with a flow through the tank; heat is in kW, its capacity in kJ/K.

use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Place, Plant, Setup, Traits};

/// Ambient temperature, degC.
const TA: f64 = 20.0;
/// Heat capacity flow through the tank, kW/K.
const F: f64 = 0.1;

pub const PLANT: Plant = Plant {
    name: "jacket",
    states: &[("T", "degC"), ("Tj", "degC")],
    inputs: &[("P", "kW"), ("Ti", "degC")],
    outputs: &[Output { state: 0, noise: 0.05, lsb: 0.02 }, Output { state: 1, noise: 0.05, lsb: 0.02 }],
    places: &[Place::Process { x: 0 }, Place::Process { x: 1 }],
    parameters: &[
        Parameter { name: "C", unit: "kJ/K", nominal: 80.0 },
        Parameter { name: "Cj", unit: "kJ/K", nominal: 25.0 },
        Parameter { name: "h", unit: "kW/K", nominal: 0.35 },
        Parameter { name: "hl", unit: "kW/K", nominal: 0.03 },
    ],
    constants: &[("Ta", TA, "degC"), ("F", F, "kW/K")],
    equations: r#"der        = { T = "C*T' = h*(Tj - T) + F*(Ti - T)", Tj = "Cj*Tj' = P - h*(Tj - T) - hl*(Tj - Ta)" }
"#,
    rates: |x, u, p, w, dx| {
        let through = p[2] * (x[1] - x[0]);
        dx[0] = (through + F * (u[1] - x[0]) + w[0]) / p[0];
        dx[1] = (u[0] - through - p[3] * (x[1] - TA) + w[1]) / p[1];
    },
    setup: |draw, _| {
        let samples = 600 + draw.below(500);
        let high = draw.between(4.0, 7.0);
        let p = excitation::steps(draw, samples, 10.0, (150.0, 1200.0), (0.0, high));
        let ti = excitation::steps(draw, samples, 10.0, (600.0, 2500.0), (12.0, 25.0));
        let start = vec![draw.between(20.0, 45.0), draw.between(25.0, 55.0)];
        Setup { dt: 10.0, samples, start, inputs: vec![p, ti] }
    },
    traits: Traits { thermal: true, linear: true, ..PLAIN },
};
