//! External forces and flows, and time-varying parameters.

use std::f64::consts::TAU;

use mops_math as math;

use super::fits::{Effect, any_joint, any_place, real_actuator};
use super::{Family, Scene};
use crate::law::{At, Law, Spot};
use crate::plant::Plant;

fn masses(plant: &Plant) -> Vec<Spot> {
    plant.traits.mass.map(|_| vec![Spot::Place(plant.places.len() - 1)]).unwrap_or_default()
}

fn athermal(plant: &Plant) -> Vec<Spot> {
    if plant.traits.thermal { Vec::new() } else { any_place(plant) }
}

/// Smooth step of a parameter, in the calibration experiment only. Returns its start and duration, s, and the active
/// share: 0 before, 1 after.
fn step(s: &Scene<'_>) -> (f64, f64, impl Fn(&At<'_>) -> f64 + Send + Sync + Copy + 'static) {
    let end = s.setup.duration();
    let (from, length) = (end * s.between(0.2, 0.7), end * s.between(0.01, 0.1));
    let share = move |at: &At<'_>| {
        let c = ((at.t - from) / length).clamp(0.0, 1.0);
        if at.experiment == 0 { c * c * (3.0 - 2.0 * c) } else { 0.0 }
    };
    (from, length, share)
}

pub const ALL: &[Effect] = &[
    Effect {
        name: "constant-force",
        fits: athermal,
        build: |s| {
            let sign = s.sign();
            Family::up_to(0.8 * s.force, move |a| {
                (Law { force: Some(Box::new(move |_| sign * a)), ..Law::default() }, vec![("force", sign * a)])
            })
        },
    },
    Effect {
        name: "periodic-disturbance",
        fits: any_place,
        build: |s| {
            // At least three periods, at most a tenth of the sample rate; the phase differs between experiments.
            let slow = 3.0 * TAU / s.setup.duration();
            let omega = (s.omega * s.between(0.6, 3.0)).clamp(slow, 0.1 * TAU / s.setup.dt);
            let phases = [s.between(-3.0, 3.0), s.between(-3.0, 3.0), s.between(-3.0, 3.0)];
            Family::up_to(1.5 * s.force, move |a| {
                let force = move |at: &At<'_>| a * math::sin(omega * at.t + phases[at.experiment]);
                (
                    Law { force: Some(Box::new(force)), ..Law::default() },
                    vec![("amplitude", a), ("frequency", omega), ("phase", phases[0])],
                )
            })
        },
    },
    Effect {
        name: "wind-gust",
        fits: any_place,
        build: |s| {
            // One smooth pulse, in the calibration experiment only.
            let (sign, end) = (s.sign(), s.setup.duration());
            let (from, long) = (end * s.between(0.2, 0.6), end * s.between(0.08, 0.25));
            Family::up_to(3.0 * s.force, move |a| {
                let force = move |at: &At<'_>| {
                    let c = (at.t - from) / long;
                    if at.experiment == 0 && (0.0..1.0).contains(&c) {
                        sign * a * 0.5 * (1.0 - math::cos(TAU * c))
                    } else {
                        0.0
                    }
                };
                (
                    Law { force: Some(Box::new(force)), ..Law::default() },
                    vec![("amplitude", sign * a), ("from", from), ("length", long)],
                )
            })
        },
    },
    Effect {
        name: "mass-loss",
        fits: masses,
        build: |s| {
            let (mass, full) = (s.plant.traits.mass?, s.p[s.plant.traits.mass?]);
            // At most 70 % is lost in the calibration experiment; in longer experiments at least 15 % remains.
            let most = 0.7 * full / s.setup.duration();
            Family::up_to(most, move |rate| {
                let law = Law {
                    parameters: Some(Box::new(move |t, p| p[mass] = (p[mass] - rate * t.max(0.0)).max(0.15 * full))),
                    ..Law::default()
                };
                (law, vec![("rate", rate)])
            })
        },
    },
    Effect {
        name: "damping-drift",
        fits: any_joint,
        build: |s| {
            // The damping only increases, because a decrease could make it negative.
            Family::up_to(2.0 * s.force / s.speed / s.setup.duration(), |r| {
                (Law { force: Some(Box::new(move |at| -r * at.t * at.v)), ..Law::default() }, vec![("rate", r)])
            })
        },
    },
    Effect {
        name: "input-gain-drift",
        fits: real_actuator,
        build: |s| {
            let sign = s.sign();
            // Other experiments may be twice as long; no command must change its sign.
            Family::up_to(0.45 / s.setup.duration(), move |r| {
                let law = Law { actuate: Some(Box::new(move |at, u| u * (1.0 + sign * r * at.t))), ..Law::default() };
                (law, vec![("rate", sign * r)])
            })
        },
    },
    Effect {
        name: "damping-step",
        fits: any_joint,
        build: |s| {
            let (from, length, share) = step(s);
            Family::up_to(2.0 * s.force / s.speed, move |d| {
                let law = Law { force: Some(Box::new(move |at| -d * share(at) * at.v)), ..Law::default() };
                (law, vec![("damping", d), ("from", from), ("length", length)])
            })
        },
    },
    Effect {
        name: "input-gain-step",
        fits: real_actuator,
        build: |s| {
            let (sign, (from, length, share)) = (s.sign(), step(s));
            Family::up_to(0.9, move |g| {
                let law =
                    Law { actuate: Some(Box::new(move |at, u| u * (1.0 + sign * g * share(at)))), ..Law::default() };
                (law, vec![("gain", sign * g), ("from", from), ("length", length)])
            })
        },
    },
];
