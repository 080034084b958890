//! Friction and drag.

use mops_math as math;

use super::Family;
use super::fits::{Effect, any_joint, joints};
use crate::law::{Dry, Law, Spot};
use crate::plant::{Place, Plant};

/// Returns the joints without viscous friction in the baseline model.
fn undamped(plant: &Plant) -> Vec<Spot> {
    joints(plant, |place| matches!(place, Place::Joint { damped: false, .. }))
}

/// Returns the joints with bearings; a ball in flight has none.
fn bearings(plant: &Plant) -> Vec<Spot> {
    if plant.name == "ball" { Vec::new() } else { any_joint(plant) }
}

/// Creates dry friction with the same level in both directions.
fn dry(slide: impl Fn(f64, f64) -> f64 + Send + Sync + 'static, hold: f64) -> Law {
    let levels = move |at: &crate::law::At<'_>, _: f64| Dry { slide: slide(at.q, at.v.abs()), hold };
    Law { dry: Some(Box::new(levels)), ..Law::default() }
}

pub const ALL: &[Effect] = &[
    Effect {
        name: "coulomb-friction",
        fits: bearings,
        build: |s| Family::up_to(0.9 * s.force, |c| (dry(move |_, _| c, c), vec![("torque", c)])),
    },
    Effect {
        name: "stribeck-friction",
        fits: bearings,
        build: |s| {
            let (ratio, vs) = (s.between(1.5, 2.5), s.speed * s.between(0.05, 0.25));
            Family::up_to(0.6 * s.force, move |c| {
                let slide = move |_, v: f64| c * (1.0 + (ratio - 1.0) * math::exp(-math::powi(v / vs, 2)));
                (dry(slide, ratio * c), vec![("coulomb", c), ("static", ratio * c), ("speed", vs)])
            })
        },
    },
    Effect {
        name: "stiction",
        fits: bearings,
        build: |s| {
            let ratio = s.between(1.4, 2.2);
            Family::up_to(0.7 * s.force, move |c| {
                (dry(move |_, _| c, ratio * c), vec![("coulomb", c), ("static", ratio * c)])
            })
        },
    },
    Effect {
        name: "asymmetric-friction",
        fits: bearings,
        build: |s| {
            let skew = s.sign() * s.between(0.3, 0.7);
            Family::up_to(0.7 * s.force, move |c| {
                let level = move |way: f64| c * (1.0 + way * skew);
                let levels = move |_: &crate::law::At<'_>, way| Dry { slide: level(way), hold: level(way) };
                let law = Law { dry: Some(Box::new(levels)), ..Law::default() };
                (law, vec![("forward", level(1.0)), ("backward", level(-1.0))])
            })
        },
    },
    Effect {
        name: "position-dependent-friction",
        fits: bearings,
        build: |s| {
            let (depth, phase) = (s.between(0.5, 0.9), s.between(-3.0, 3.0));
            let n = if s.is_angle() { (1 + s.below(3)) as f64 } else { s.between(2.0, 5.0) / s.reach() };
            Family::up_to(0.7 * s.force, move |c| {
                let level = move |q: f64| c * (1.0 + depth * math::cos(n * q + phase));
                let levels = move |at: &crate::law::At<'_>, _| Dry { slide: level(at.q), hold: level(at.q) };
                let law = Law { dry: Some(Box::new(levels)), ..Law::default() };
                (law, vec![("torque", c), ("depth", depth), ("waves", n), ("phase", phase)])
            })
        },
    },
    Effect {
        name: "dahl",
        fits: bearings,
        build: |s| {
            // The bristles deflect by c/stiffness before they slide.
            let bend = s.reach() * s.between(0.01, 0.06);
            Family::up_to(0.9 * s.force, move |c| {
                let stiffness = c / bend;
                let law = Law {
                    states: vec![0.0],
                    rates: Some(Box::new(move |at, dz| dz[0] = at.v * (1.0 - at.z[0] / bend * at.v.signum()))),
                    force: Some(Box::new(move |at| -stiffness * at.z[0])),
                    ..Law::default()
                };
                (law, vec![("torque", c), ("stiffness", stiffness)])
            })
        },
    },
    Effect {
        name: "viscous-friction",
        fits: undamped,
        build: |s| Family::up_to(2.0 * s.force / s.speed, |d| (push(move |v| -d * v), vec![("damping", d)])),
    },
    Effect {
        name: "quadratic-drag",
        fits: any_joint,
        build: |s| {
            Family::up_to(4.0 * s.force / math::powi(s.speed, 2), |k| {
                (push(move |v| -k * v * v.abs()), vec![("drag", k)])
            })
        },
    },
    Effect {
        name: "cubic-damping",
        fits: any_joint,
        build: |s| {
            Family::up_to(4.0 * s.force / math::powi(s.speed, 3), |k| {
                (push(move |v| -k * math::powi(v, 3)), vec![("drag", k)])
            })
        },
    },
];

/// Creates a force that depends on the speed.
fn push(force: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Law {
    Law { force: Some(Box::new(move |at| force(at.v))), ..Law::default() }
}
