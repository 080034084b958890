//! Effects outside every catalogue: no sum of a few catalogue effects reproduces their shapes.

use std::f64::consts::TAU;

use mops_math as math;

use crate::draw::Draw;
use crate::effects::{Effect, Family, Scene, any_joint, any_place, any_sensor, processes};
use crate::law::{At, Law};

/// Creates a force or flow.
fn force(f: impl Fn(&At<'_>) -> f64 + Send + Sync + 'static) -> Law {
    Law { force: Some(Box::new(f)), ..Law::default() }
}

/// Bumps `sum +-exp(-((q - c)/w)^2)` at random positions over a range widened by a fifth.
fn bumps(s: &Scene<'_>, n: usize, width: f64) -> impl Fn(f64) -> f64 + Send + Sync + Clone + 'static {
    let width = width * s.reach();
    let mut sign = s.sign();
    let shapes: Vec<(f64, f64)> = (0..n)
        .map(|i| {
            // Spread over the range, with irregular signs and amplitudes of 0.5 to 1.
            if s.chance(0.65) {
                sign = -sign;
            }
            let c = -0.1 + 1.2 * (i as f64 + s.between(0.1, 0.9)) / n as f64;
            (s.range.0 + c * (s.range.1 - s.range.0), sign * s.between(0.5, 1.0))
        })
        .collect();
    move |q| shapes.iter().map(|(c, a)| a * math::exp(-math::powi((q - c) / width, 2))).sum()
}

/// Random telegraph signal between -1 and 1 with exponentially distributed times, different in every experiment.
fn telegraph(s: &Scene<'_>, mean: f64) -> [Vec<f64>; 3] {
    let end = 2.0 * s.setup.duration();
    [0, 1, 2].map(|experiment| {
        let mut draw =
            Draw::new((s.between(0.0, 1.0) * math::powi(2.0, 53)) as u64, &format!("telegraph {experiment}"));
        let mut t = -mean;
        let mut jumps = Vec::new();
        while t < end {
            t += -mean * math::ln(1.0 - draw.between(0.0, 1.0));
            jumps.push(t);
        }
        jumps
    })
}

/// Returns the effects outside every catalogue.
pub fn outside() -> Vec<&'static Effect> {
    ALL.iter().collect()
}

const ALL: &[Effect] = &[
    Effect {
        name: "short-range-magnet",
        fits: any_joint,
        build: |s| {
            // -A r exp(-r^2), with r the distance in widths.
            let (centre, width) = (s.within(0.35, 0.65), s.reach() * s.between(0.06, 0.15));
            Family::up_to(8.0 * s.force, move |a| {
                let pull = move |at: &At<'_>| {
                    let r = (at.q - centre) / width;
                    -a * r * math::exp(-r * r)
                };
                (force(pull), vec![("force", a), ("centre", centre), ("width", width)])
            })
        },
    },
    Effect {
        name: "bumpy-force",
        fits: any_place,
        build: |s| {
            let bumps = bumps(s, 6 + s.below(4), 0.1);
            Family::up_to(4.0 * s.force, move |a| {
                let bumps = bumps.clone();
                (force(move |at| a * bumps(at.q)), vec![("force", a)])
            })
        },
    },
    Effect {
        name: "random-telegraph",
        fits: any_place,
        build: |s| {
            let jumps = telegraph(s, s.setup.duration() / s.between(8.0, 20.0));
            Family::up_to(2.0 * s.force, move |a| {
                let jumps = jumps.clone();
                let signal = move |at: &At<'_>| {
                    if jumps[at.experiment].partition_point(|&jump| jump <= at.t) % 2 == 0 { a } else { -a }
                };
                (force(signal), vec![("force", a)])
            })
        },
    },
    Effect {
        name: "negative-damping-band",
        fits: any_joint,
        build: |s| {
            // Drives the motion within a band of positions and brakes it outside.
            let (centre, width) = (s.within(0.25, 0.75), s.reach() * s.between(0.12, 0.3));
            Family::up_to(6.0 * s.force / s.speed, move |d| {
                let push = move |at: &At<'_>| {
                    let r2 = math::powi((at.q - centre) / width, 2);
                    d * at.v * (1.0 - 2.0 * r2) * math::exp(-r2)
                };
                (force(push), vec![("damping", d), ("centre", centre), ("width", width)])
            })
        },
    },
    Effect {
        name: "chirping-force",
        fits: any_place,
        build: |s| {
            // A wandering frequency, which no sine and no pulse can follow.
            let (base, sway) = (s.omega * s.between(0.5, 1.5), s.between(2.0, 4.0));
            let (slow, end) = (TAU * s.between(1.5, 3.5), s.setup.duration());
            let phases = [s.between(-3.0, 3.0), s.between(-3.0, 3.0), s.between(-3.0, 3.0)];
            let base = base.clamp(6.0 * TAU / end, 0.08 * TAU / s.setup.dt);
            Family::up_to(2.0 * s.force, move |a| {
                let signal = move |at: &At<'_>| {
                    let wander = sway * math::sin(slow * at.t / end + 2.0 * phases[at.experiment]);
                    a * math::sin(base * at.t + wander * 2.0 + phases[at.experiment])
                };
                (force(signal), vec![("force", a), ("frequency", base)])
            })
        },
    },
    Effect {
        name: "relay",
        fits: processes,
        build: |s| {
            // A hidden thermostat: on below one level, off above another.
            let (low, high) = (s.within(0.3, 0.45), s.within(0.55, 0.7));
            Family::up_to(3.0 * s.force, move |a| {
                let law = Law {
                    states: vec![1.0],
                    settle: Some(Box::new(move |at, z| {
                        if at.q < low {
                            z[0] = 1.0;
                        } else if at.q > high {
                            z[0] = -1.0;
                        }
                    })),
                    ..force(move |at| a * at.z[0])
                };
                (law, vec![("flow", a), ("low", low), ("high", high)])
            })
        },
    },
    Effect {
        name: "bumpy-sensor",
        fits: any_sensor,
        build: |s| {
            let bumps = bumps(s, 6 + s.below(4), 0.09);
            Family::up_to(0.25 * s.reach(), move |a| {
                let bumps = bumps.clone();
                (Law { sense: Some(Box::new(move |_, y| y + a * bumps(y))), ..Law::default() }, vec![("amplitude", a)])
            })
        },
    },
];
