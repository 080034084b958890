//! Springs, end stops, backlash, and forces periodic in the position.

use mops_math as math;

use super::fits::{Effect, any_joint, joints};
use super::{Family, Scene};
use crate::law::{Law, Spot};
use crate::plant::{Place, Plant};

/// Creates a force that depends on the position.
fn pull(force: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Law {
    Law { force: Some(Box::new(move |at| force(at.q))), ..Law::default() }
}

/// Returns the joints without a spring in the baseline model; a ball in flight has no joint.
fn unsprung(plant: &Plant) -> Vec<Spot> {
    if plant.name == "ball" {
        return Vec::new();
    }
    joints(plant, |place| matches!(place, Place::Joint { sprung: false, .. }))
}

fn mechanisms(plant: &Plant) -> Vec<Spot> {
    if plant.name == "ball" { Vec::new() } else { any_joint(plant) }
}

/// Returns the joints and couplings whose springs may have backlash.
fn gaps(plant: &Plant) -> Vec<Spot> {
    if plant.traits.spring.is_some() || plant.traits.coupling.is_some() { vec![Spot::Place(0)] } else { Vec::new() }
}

/// Returns the largest distance from a position.
fn farthest(s: &Scene<'_>, from: f64) -> f64 {
    (s.range.1 - from).abs().max((s.range.0 - from).abs())
}

/// Returns the spatial angular frequency, rad per unit of position.
fn waves(s: &Scene<'_>) -> f64 {
    if s.is_angle() { (2 + s.below(7)) as f64 } else { s.between(3.0, 10.0) / s.reach() }
}

pub const ALL: &[Effect] = &[
    Effect {
        name: "linear-stiffness",
        fits: unsprung,
        build: |s| {
            let rest = s.rest() + if s.chance(0.5) { 0.0 } else { 0.3 * s.reach() * s.between(-1.0, 1.0) };
            Family::up_to(2.0 * s.force / farthest(s, rest), move |k| {
                (pull(move |q| -k * (q - rest)), vec![("stiffness", k), ("rest", rest)])
            })
        },
    },
    Effect {
        name: "quadratic-stiffness",
        fits: mechanisms,
        build: |s| {
            let (rest, sign) = (s.rest(), s.sign());
            Family::up_to(1.0 * s.force / math::powi(farthest(s, rest), 2), move |k| {
                (pull(move |q| -sign * k * math::powi(q - rest, 2)), vec![("stiffness", sign * k)])
            })
        },
    },
    Effect {
        name: "cubic-stiffness",
        fits: mechanisms,
        build: |s| {
            // Mostly hardening.
            let (rest, sign) = (s.rest(), if s.chance(0.75) { 1.0 } else { -1.0 });
            let most = if sign > 0.0 { 3.0 } else { 0.4 };
            Family::up_to(most * s.force / math::powi(farthest(s, rest), 3), move |k| {
                (pull(move |q| -sign * k * math::powi(q - rest, 3)), vec![("stiffness", sign * k)])
            })
        },
    },
    Effect {
        name: "end-stop",
        fits: mechanisms,
        build: |s| {
            // A stiff spring with some damping; the free magnitude is the distance of the stop from the end of the
            // range.
            let (low, high) = s.range;
            let side = s.sign();
            let omega = (0.2 * 20.0 / s.setup.dt).min(15.0 * s.omega);
            let (stiffness, damping) = (s.inertia.abs() * omega * omega, 0.4 * s.inertia.abs() * omega);
            Family::up_to(0.6, move |inside| {
                let stop = if side > 0.0 { high - inside * (high - low) } else { low + inside * (high - low) };
                let force = move |at: &crate::law::At<'_>| {
                    let deep = side * (at.q - stop);
                    if deep > 0.0 { -side * (stiffness * deep + damping * side * at.v).max(0.0) } else { 0.0 }
                };
                (
                    Law { force: Some(Box::new(force)), ..Law::default() },
                    vec![("position", stop), ("side", side), ("stiffness", stiffness)],
                )
            })
        },
    },
    Effect {
        name: "backlash",
        fits: gaps,
        build: |s| {
            if let Some(k) = s.plant.traits.coupling {
                let k = s.p[k];
                // Cancels the shaft torque of the baseline model within the gap.
                return Family::up_to(0.3, move |gap| {
                    let force = move |at: &crate::law::At<'_>| k * (at.x[0] - at.x[2]).clamp(-gap, gap);
                    let law = Law { force: Some(Box::new(force)), also: vec![(1, -1.0)], ..Law::default() };
                    (law, vec![("gap", gap)])
                });
            }
            let k = s.p[s.plant.traits.spring?];
            Family::up_to(0.5 * s.peak(), move |gap| (pull(move |q| k * q.clamp(-gap, gap)), vec![("gap", gap)]))
        },
    },
    Effect {
        name: "cogging",
        fits: mechanisms,
        build: |s| {
            let (n, phase) = (waves(s), s.between(-3.0, 3.0));
            Family::up_to(1.2 * s.force, move |a| {
                (pull(move |q| a * math::sin(n * q + phase)), vec![("torque", a), ("waves", n), ("phase", phase)])
            })
        },
    },
    Effect {
        name: "flexible-mode",
        fits: mechanisms,
        build: |s| {
            // A mass on a spring: z'' = w0^2 (q - z) + 2 zeta w0 (v - z'), with the reaction force m z''.
            let w0 = (s.omega * s.between(1.3, 4.0)).min(1.5 / s.setup.dt * 0.2);
            let zeta = s.between(0.02, 0.1);
            Family::up_to(0.8 * s.inertia.abs(), move |m| {
                let pull = move |q: f64, v: f64, z: &[f64]| w0 * w0 * (q - z[0]) + 2.0 * zeta * w0 * (v - z[1]);
                let law = Law {
                    states: vec![0.0; 2],
                    begin: Some(Box::new(|at, z| z.copy_from_slice(&[at.q, at.v]))),
                    rates: Some(Box::new(move |at, dz| {
                        dz[0] = at.z[1];
                        dz[1] = pull(at.q, at.v, at.z);
                    })),
                    force: Some(Box::new(move |at| -m * pull(at.q, at.v, at.z))),
                    ..Law::default()
                };
                (law, vec![("mass", m), ("frequency", w0), ("damping", zeta)])
            })
        },
    },
    Effect {
        name: "bouc-wen",
        fits: mechanisms,
        build: |s| {
            // z saturates at (1/(b + g))^(1/n).
            let yield_at = s.reach() * s.between(0.05, 0.3);
            let n = if s.chance(0.5) { 1 } else { 2 };
            let sum = math::powi(yield_at, -n);
            let b = s.between(0.4, 0.9) * sum;
            let g = sum - b;
            Family::up_to(1.2 * s.force / yield_at, move |k| {
                let law = Law {
                    states: vec![0.0],
                    rates: Some(Box::new(move |at, dz| {
                        let z = at.z[0];
                        dz[0] =
                            at.v - b * at.v.abs() * math::powi(z.abs(), n - 1) * z - g * at.v * math::powi(z.abs(), n);
                    })),
                    force: Some(Box::new(move |at| -k * at.z[0])),
                    ..Law::default()
                };
                (law, vec![("stiffness", k), ("beta", b), ("gamma", g), ("power", f64::from(n))])
            })
        },
    },
];
