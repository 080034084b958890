//! Rotary (Furuta) pendulum: arm angle ph, pendulum angle th, 0 upright.

use std::f64::consts::{PI, TAU};

use mops_math as math;

use super::places::angle;
use crate::excitation;
use crate::plant::{Output, PLAIN, Parameter, Plant, Setup};

/// Inertia of the pendulum, which a free swing cannot identify: all other inertias are relative to it.
const A: f64 = 0.0044;

/// Released, without torque.
pub const FREE: Plant = Plant {
    name: "furuta-free",
    constants: &[("a", A, "kg m2")],
    parameters: &[
        Parameter { name: "b", unit: "kg m2", nominal: 0.008 },
        Parameter { name: "c", unit: "kg m2", nominal: 0.0037 },
        Parameter { name: "d", unit: "N m", nominal: 0.22 },
        Parameter { name: "bp", unit: "N m s/rad", nominal: 0.0003 },
        Parameter { name: "ba", unit: "N m s/rad", nominal: 0.0015 },
    ],
    rates: |x, _, p, w, dx| rates(x, 0.0, &[A, p[0], p[1], p[2], p[3], p[4]], w, dx),
    inputs: &[],
    equations: FREE_EQUATIONS,
    setup: |draw, _| {
        let samples = 500 + draw.below(400);
        let start = vec![
            PI + draw.sign() * draw.between(0.5, 1.9),
            draw.between(-1.5, 1.5),
            draw.between(-0.5, 0.5),
            draw.between(-2.5, 2.5),
        ];
        Setup { dt: 0.01, samples, start, inputs: vec![] }
    },
    ..DRIVEN
};

/// Driven by a torque on the arm.
pub const DRIVEN: Plant = Plant {
    name: "furuta-driven",
    states: &[("th", "rad"), ("thd", "rad/s"), ("ph", "rad"), ("phd", "rad/s")],
    inputs: &[("u", "N m")],
    outputs: &[
        Output { state: 0, noise: 0.001, lsb: TAU / 4096.0 },
        Output { state: 2, noise: 0.001, lsb: TAU / 4096.0 },
    ],
    places: &[angle(0, 1, PI), angle(2, 3, 0.0)],
    parameters: &[
        Parameter { name: "a", unit: "kg m2", nominal: 0.0048 },
        Parameter { name: "b", unit: "kg m2", nominal: 0.0085 },
        Parameter { name: "c", unit: "kg m2", nominal: 0.004 },
        Parameter { name: "d", unit: "N m", nominal: 0.23 },
        Parameter { name: "bp", unit: "N m s/rad", nominal: 0.0004 },
        Parameter { name: "ba", unit: "N m s/rad", nominal: 0.003 },
    ],
    constants: &[],
    equations: DRIVEN_EQUATIONS,
    rates: |x, u, p, w, dx| rates(x, u[0], p, w, dx),
    setup: |draw, _| {
        let samples = 500 + draw.below(400);
        let size = draw.between(0.02, 0.06);
        let start = vec![PI + draw.between(-0.6, 0.6), 0.0, draw.between(-0.4, 0.4), 0.0];
        let u = excitation::any(draw, samples, 0.01, (0.3, 2.5), size);
        Setup { dt: 0.01, samples, start, inputs: vec![u] }
    },
    traits: PLAIN,
};

/// The two equations of motion, solved for the accelerations.
fn rates(x: &[f64], u: f64, p: &[f64], w: &[f64], dx: &mut [f64]) {
    let [a, b, c, d, bp, ba] = [p[0], p[1], p[2], p[3], p[4], p[5]];
    let (thd, phd) = (x[1], x[3]);
    let (sin, cos) = math::sin_cos(x[0]);
    let m12 = c * cos;
    let m22 = b + a * sin * sin;
    let f1 = a * phd * phd * sin * cos + d * sin - bp * thd + w[0];
    let f2 = c * thd * thd * sin - 2.0 * a * thd * phd * sin * cos + u - ba * phd + w[1];
    let det = a * m22 - m12 * m12;
    dx[0] = thd;
    dx[1] = (m22 * f1 - m12 * f2) / det;
    dx[2] = phd;
    dx[3] = (a * f2 - m12 * f1) / det;
}

const DRIVEN_EQUATIONS: &str = r#"
[models.plant.equations.der]
th  = "thd"
ph  = "phd"
thd = "a*thd' - a*phd^2*sin(th)*cos(th) + c*phd'*cos(th) - d*sin(th) = -bp*thd"
phd = "c*thd'*cos(th) - c*thd^2*sin(th) + 2*a*thd*phd*sin(th)*cos(th) + (b + a*sin(th)^2)*phd' = u - ba*phd"
"#;

const FREE_EQUATIONS: &str = r#"
[models.plant.equations.der]
th  = "thd"
ph  = "phd"
thd = "a*thd' - a*phd^2*sin(th)*cos(th) + c*phd'*cos(th) - d*sin(th) = -bp*thd"
phd = "c*thd'*cos(th) - c*thd^2*sin(th) + 2*a*thd*phd*sin(th)*cos(th) + (b + a*sin(th)^2)*phd' = -ba*phd"
"#;
