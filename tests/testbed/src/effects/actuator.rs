//! Actuator effects.

use mops_math as math;

use super::Family;
use super::fits::{Effect, any_actuator, real_actuator};
use crate::law::{At, Law, Own, Spot};
use crate::plant::{Place, Plant};

/// Returns the input of a plant whose first joint is rotary.
fn motor(plant: &Plant) -> Vec<Spot> {
    let turns = matches!(plant.places.first(), Some(Place::Joint { angle: true, .. }));
    if turns { real_actuator(plant) } else { Vec::new() }
}

/// Creates a static characteristic of the command.
fn curve(f: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Law {
    Law { actuate: Some(Box::new(move |_, u| f(u))), ..Law::default() }
}

/// Initial actuator output in an experiment: the first command, or zero as after switching on.
fn first(from_command: bool) -> Option<Own> {
    from_command.then(|| -> Own { Box::new(|at, z| z[0] = at.q) })
}

pub const ALL: &[Effect] = &[
    Effect {
        name: "input-delay",
        fits: real_actuator,
        build: |s| {
            let most = (0.12 * s.setup.duration()).min(40.0 * s.setup.dt);
            Family::up_to(most, |delay| (Law { delay, ..Law::default() }, vec![("delay", delay)]))
        },
    },
    Effect {
        name: "actuator-lag",
        fits: real_actuator,
        build: |s| {
            let (from_command, most) = (s.chance(0.6), (0.12 * s.setup.duration()).min(80.0 * s.setup.dt));
            let least = 0.05 * s.setup.dt;
            Family::up_to(most, move |time| {
                let slow = time.max(least);
                let law = Law {
                    states: vec![0.0],
                    begin: first(from_command),
                    rates: Some(Box::new(move |at, dz| dz[0] = (at.q - at.z[0]) / slow)),
                    actuate: Some(Box::new(|at, _| at.z[0])),
                    ..Law::default()
                };
                (law, vec![("time", slow)])
            })
        },
    },
    Effect {
        name: "input-saturation",
        fits: real_actuator,
        build: |s| {
            let (peak, low, high) = (s.peak(), s.range.0, s.range.1);
            Family::up_to(0.75, move |cut| {
                // Commands that are never negative are limited from above.
                let limit = if low >= 0.0 { high - cut * (high - low) } else { peak * (1.0 - cut) };
                (curve(move |u| u.clamp(-limit, limit)), vec![("limit", limit)])
            })
        },
    },
    Effect {
        name: "input-dead-zone",
        fits: real_actuator,
        build: |s| {
            Family::up_to(0.6 * s.peak(), |width| (curve(move |u| u - u.clamp(-width, width)), vec![("width", width)]))
        },
    },
    Effect {
        name: "input-bias",
        fits: any_actuator,
        build: |s| {
            let sign = s.sign();
            Family::up_to(0.5 * s.peak(), move |b| (curve(move |u| u + sign * b), vec![("bias", sign * b)]))
        },
    },
    Effect {
        name: "input-asymmetry",
        fits: real_actuator,
        build: |s| {
            if s.range.0 >= 0.0 {
                return None;
            }
            let side = s.sign();
            Family::up_to(0.7, move |a| {
                let law = curve(move |u| if side * u > 0.0 { u * (1.0 - a) } else { u });
                (law, vec![("difference", side * a)])
            })
        },
    },
    Effect {
        name: "input-quadratic",
        fits: real_actuator,
        build: |s| {
            let (peak, sign) = (s.peak(), s.sign());
            Family::up_to(0.6 / peak, move |k| {
                (curve(move |u| u + sign * k * u * u.abs()), vec![("curvature", sign * k)])
            })
        },
    },
    Effect {
        name: "input-quantisation",
        fits: real_actuator,
        build: |s| {
            Family::up_to(0.8 * s.peak(), |step| (curve(move |u| (u / step).round() * step), vec![("step", step)]))
        },
    },
    Effect {
        name: "rate-limit",
        fits: real_actuator,
        build: |s| {
            // The null value of the limit is infinity, so its inverse is the free magnitude. Close to the command, the
            // output converges within less than an integrator step.
            let (from_command, peak, quick) = (s.chance(0.6), s.peak(), 0.03 * s.setup.dt);
            Family::up_to(0.25 * s.setup.duration(), move |slowness| {
                let limit = peak / slowness;
                let law = Law {
                    states: vec![0.0],
                    begin: first(from_command),
                    rates: Some(Box::new(move |at, dz| dz[0] = ((at.q - at.z[0]) / quick).clamp(-limit, limit))),
                    actuate: Some(Box::new(|at, _| at.z[0])),
                    ..Law::default()
                };
                (law, vec![("rate", limit)])
            })
        },
    },
    Effect {
        name: "backlash",
        fits: real_actuator,
        build: |s| {
            let from_command = s.chance(0.6);
            Family::up_to(0.6 * s.peak(), move |gap| {
                let law = Law {
                    states: vec![0.0],
                    begin: first(from_command),
                    settle: Some(Box::new(move |at, z| z[0] = z[0].clamp(at.q - gap, at.q + gap))),
                    actuate: Some(Box::new(|at, _| at.z[0])),
                    ..Law::default()
                };
                (law, vec![("gap", gap)])
            })
        },
    },
    Effect {
        name: "torque-ripple",
        fits: motor,
        build: |s| {
            let (turned, n, phase) = (s.plant.places[0].state(), (1 + s.below(6)) as f64, s.between(-3.0, 3.0));
            Family::up_to(0.9, move |a| {
                let ripple = move |at: &At<'_>, u: f64| u * (1.0 + a * math::sin(n * at.x[turned] + phase));
                (
                    Law { actuate: Some(Box::new(ripple)), ..Law::default() },
                    vec![("share", a), ("waves", n), ("phase", phase)],
                )
            })
        },
    },
];
