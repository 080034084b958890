//! Sensor effects.

use mops_math as math;

use super::Family;
use super::fits::{Effect, any_sensor};
use crate::law::{Law, Spot};
use crate::plant::Plant;

/// Creates a static characteristic of the measured value.
fn curve(f: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Law {
    Law { sense: Some(Box::new(move |_, y| f(y))), ..Law::default() }
}

fn one_of_several(plant: &Plant) -> Vec<Spot> {
    if plant.outputs.len() > 1 { any_sensor(plant) } else { Vec::new() }
}

fn rotary(plant: &Plant) -> Vec<Spot> {
    let angle = |o: &usize| plant.states[plant.outputs[*o].state].1 == "rad";
    (0..plant.outputs.len()).filter(angle).map(Spot::Sensor).collect()
}

pub const ALL: &[Effect] = &[
    Effect {
        name: "sensor-bias",
        fits: any_sensor,
        build: |s| {
            let sign = s.sign();
            Family::up_to(0.6 * s.reach(), move |b| (curve(move |y| y + sign * b), vec![("bias", sign * b)]))
        },
    },
    Effect {
        name: "sensor-gain",
        fits: any_sensor,
        build: |s| {
            let sign = s.sign();
            // Angles count from the zero of the sensor.
            Family::up_to(0.4, move |g| (curve(move |y| (1.0 + sign * g) * y), vec![("gain", 1.0 + sign * g)]))
        },
    },
    Effect {
        name: "sensor-delay",
        fits: any_sensor,
        build: |s| {
            let most = (0.06 * s.setup.duration()).min(30.0 * s.setup.dt);
            Family::up_to(most, |delay| (Law { delay, ..Law::default() }, vec![("delay", delay)]))
        },
    },
    Effect {
        name: "sensor-lag",
        fits: any_sensor,
        build: |s| {
            let (most, least) = ((0.08 * s.setup.duration()).min(60.0 * s.setup.dt), 0.05 * s.setup.dt);
            Family::up_to(most, move |time| {
                let slow = time.max(least);
                let law = Law {
                    states: vec![0.0],
                    begin: Some(Box::new(|at, z| z[0] = at.q)),
                    rates: Some(Box::new(move |at, dz| dz[0] = (at.q - at.z[0]) / slow)),
                    sense: Some(Box::new(|at, _| at.z[0])),
                    ..Law::default()
                };
                (law, vec![("time", slow)])
            })
        },
    },
    Effect {
        name: "sensor-drift",
        fits: any_sensor,
        build: |s| {
            let sign = s.sign();
            Family::up_to(s.reach() / s.setup.duration(), move |rate| {
                let law = Law { sense: Some(Box::new(move |at, y| y + sign * rate * at.t.max(0.0))), ..Law::default() };
                (law, vec![("rate", sign * rate)])
            })
        },
    },
    Effect {
        name: "sensor-dead-zone",
        fits: any_sensor,
        build: |s| {
            // Gap of a potentiometer: inside it the reading stays at the centre; or a dead band that shifts all other
            // readings.
            let (middle, shifts) = (s.within(0.3, 0.7), s.chance(0.5));
            Family::up_to(0.35 * s.reach(), move |width| {
                let law = curve(move |y| {
                    let off = y - middle;
                    match (shifts, off.abs() < width) {
                        (_, true) => middle,
                        (false, false) => y,
                        (true, false) => y - width * off.signum(),
                    }
                });
                (law, vec![("width", width), ("middle", middle), ("shifts", if shifts { 1.0 } else { 0.0 })])
            })
        },
    },
    Effect {
        name: "sensor-saturation",
        fits: any_sensor,
        build: |s| {
            let (low, high, top) = (s.range.0, s.range.1, s.chance(0.6));
            Family::up_to(0.35, move |cut| {
                let limit = if top { high - cut * (high - low) } else { low + cut * (high - low) };
                let law = if top { curve(move |y| y.min(limit)) } else { curve(move |y| y.max(limit)) };
                (law, vec![("limit", limit), ("side", if top { 1.0 } else { -1.0 })])
            })
        },
    },
    Effect {
        name: "sensor-quantisation",
        fits: any_sensor,
        build: |s| {
            Family::up_to(0.5 * s.reach(), |step| (curve(move |y| (y / step).round() * step), vec![("step", step)]))
        },
    },
    Effect {
        name: "eccentricity",
        fits: rotary,
        build: |s| {
            let phase = s.between(-3.0, 3.0);
            Family::up_to(0.3, move |a| {
                (curve(move |y| y + a * math::sin(y + phase)), vec![("amplitude", a), ("phase", phase)])
            })
        },
    },
    Effect {
        name: "cross-talk",
        fits: one_of_several,
        build: |s| {
            let Spot::Sensor(o) = s.spot else { return None };
            let (sign, other) = (s.sign(), s.plant.outputs[1 - o.min(1)].state);
            Family::up_to(0.3, move |c| {
                let law = Law { sense: Some(Box::new(move |at, y| y + sign * c * at.x[other])), ..Law::default() };
                (law, vec![("share", sign * c)])
            })
        },
    },
];
