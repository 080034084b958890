//! Plants of the twins: equations `inertia x' = side(x, u) + added terms`.

use mops_math as math;

/// Position and speed of a joint, as indices of the states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Joint {
    /// Position.
    pub q: usize,
    /// Speed.
    pub v: usize,
}

/// Plant with one input.
#[derive(Debug)]
pub struct Body {
    /// Name.
    pub name: &'static str,
    /// Names of the states.
    pub states: &'static [&'static str],
    /// Initial values of the states.
    pub start: &'static [f64],
    /// Factor of the rate in the equation of each state: masses, capacities.
    pub inertias: &'static [f64],
    /// Joints.
    pub joints: &'static [Joint],
    /// Writes the right-hand sides of the equations.
    pub sides: fn(x: &[f64], u: f64, sides: &mut [f64]),
}

/// Plants whose signals, speeds, forces and times are of the order of 1.
pub const BODIES: [Body; 3] = [
    Body {
        name: "heater",
        states: &["T", "S"],
        start: &[0.3, 0.0],
        inertias: &[1.0, 2.0],
        joints: &[],
        sides: |x, u, sides| {
            let exchange = 0.4 * (x[0] - x[1]);
            (sides[0], sides[1]) = (u - 0.9 * x[0] - exchange, exchange);
        },
    },
    Body {
        name: "pendulum",
        states: &["th", "w"],
        start: &[0.4, 0.0],
        inertias: &[1.0, 1.0],
        joints: &[Joint { q: 0, v: 1 }],
        sides: |x, u, sides| (sides[0], sides[1]) = (x[1], u - 4.0 * math::sin(x[0]) - 0.1 * x[1]),
    },
    Body {
        name: "masses",
        states: &["x", "v", "y", "w"],
        start: &[0.0, 0.0, 0.0, 0.0],
        inertias: &[1.0, 1.0, 1.0, 0.7],
        joints: &[Joint { q: 0, v: 1 }, Joint { q: 2, v: 3 }],
        sides: |x, u, sides| {
            let spring = 5.0 * (x[0] - x[2]) + 0.2 * (x[1] - x[3]);
            (sides[0], sides[1]) = (x[1], u - spring - x[0]);
            (sides[2], sides[3]) = (x[3], spring);
        },
    },
];
