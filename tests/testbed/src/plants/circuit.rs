//! Two resistors and two capacitors in a chain behind a voltage source; slower than the usual ms range.

use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Place, Plant, Setup, Traits};

/// First capacitor, F: the voltages determine only ratios.
const C1: f64 = 0.001;

pub const PLANT: Plant = Plant {
    name: "circuit",
    states: &[("V1", "V"), ("V2", "V")],
    inputs: &[("u", "V")],
    outputs: &[Output { state: 0, noise: 0.005, lsb: 0.005 }, Output { state: 1, noise: 0.005, lsb: 0.005 }],
    places: &[Place::Process { x: 0 }, Place::Process { x: 1 }],
    parameters: &[
        Parameter { name: "R1", unit: "V/A", nominal: 220.0 },
        Parameter { name: "R2", unit: "V/A", nominal: 470.0 },
        Parameter { name: "C2", unit: "A s/V", nominal: 0.0015 },
    ],
    constants: &[("C1", C1, "A s/V")],
    equations: r#"let        = { i1 = "(u - V1)/R1", i2 = "(V1 - V2)/R2" }
der        = { V1 = "C1*V1' = i1 - i2", V2 = "C2*V2' = i2" }
"#,
    rates: |x, u, p, w, dx| {
        let (i1, i2) = ((u[0] - x[0]) / p[0], (x[0] - x[1]) / p[1]);
        dx[0] = (i1 - i2 + w[0]) / C1;
        dx[1] = (i2 + w[1]) / p[2];
    },
    setup: |draw, _| {
        let samples = 600 + draw.below(600);
        let size = draw.between(3.0, 8.0);
        let u = excitation::any(draw, samples, 0.01, (0.15, 3.0), size);
        Setup { dt: 0.01, samples, start: vec![draw.between(-3.0, 3.0), draw.between(-3.0, 3.0)], inputs: vec![u] }
    },
    traits: Traits { linear: true, ..PLAIN },
};
