//! Flows of liquid, heat and charge.

use mops_math as math;

use super::Family;
use super::fits::{Effect, processes};
use crate::law::{At, Law, Spot};
use crate::plant::Plant;

/// 0 degC, K.
const ICE: f64 = 273.15;

fn levels(plant: &Plant) -> Vec<Spot> {
    if plant.traits.levels { processes(plant) } else { Vec::new() }
}

fn temperatures(plant: &Plant) -> Vec<Spot> {
    if plant.traits.thermal { processes(plant) } else { Vec::new() }
}

fn flow(f: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Law {
    Law { force: Some(Box::new(move |at: &At<'_>| f(at.q))), ..Law::default() }
}

pub const ALL: &[Effect] = &[
    Effect {
        name: "leak",
        fits: levels,
        build: |s| {
            // A hole at a height within the range of levels, or at the bottom.
            let height = if s.chance(0.7) { s.within(0.1, 0.6) } else { 0.0 };
            Family::up_to(3.0 * s.force / s.peak().sqrt(), move |k| {
                (flow(move |h| -k * (h - height).max(0.0).sqrt()), vec![("flow", k), ("height", height)])
            })
        },
    },
    Effect {
        name: "overflow",
        fits: levels,
        build: |s| {
            // A weir below the highest level; a share of the overflow runs into the next tank.
            let (level, share) = (s.within(0.5, 0.9), if s.spot == Spot::Place(0) { s.between(0.0, 1.0) } else { 0.0 });
            Family::up_to(8.0 * s.force / s.reach(), move |k| {
                let law = Law { also: vec![(1, -share)], ..flow(move |h| -k * (h - level).max(0.0)) };
                let law = if share > 0.0 { law } else { Law { also: vec![], ..law } };
                (law, vec![("flow", k), ("level", level), ("share", share)])
            })
        },
    },
    Effect {
        name: "linear-loss",
        fits: levels,
        build: |s| Family::up_to(3.0 * s.force / s.peak(), |k| (flow(move |h| -k * h.max(0.0)), vec![("flow", k)])),
    },
    Effect {
        name: "constant-heat-gain",
        fits: temperatures,
        build: |s| {
            let sign = if s.chance(0.8) { 1.0 } else { -1.0 };
            Family::up_to(2.0 * s.force, move |a| (flow(move |_| sign * a), vec![("power", sign * a)]))
        },
    },
    Effect {
        name: "radiation-loss",
        fits: temperatures,
        build: |s| {
            // Ambient temperature: the second input in a room, otherwise 20 degC. Over the temperature range, the
            // fourth power is almost linear.
            let outdoors = s.plant.name == "room";
            let span = 4.0 * math::powi(ICE + s.range.1, 3) * (s.range.1 - 10.0).abs().max(10.0);
            Family::up_to(6.0 * s.force / span, move |k| {
                let law = move |at: &At<'_>| {
                    let around = if outdoors { at.u[1] } else { 20.0 };
                    -k * (math::powi(at.q + ICE, 4) - math::powi(around + ICE, 4))
                };
                (Law { force: Some(Box::new(law)), ..Law::default() }, vec![("coefficient", k)])
            })
        },
    },
    Effect {
        name: "hidden-thermal-mass",
        fits: temperatures,
        build: |s| {
            // Walls: z' = (T - z)/time, absorbing coupling*(T - z).
            let time = s.setup.duration() * s.between(0.03, 0.15);
            let apart = s.between(-3.0, 3.0);
            Family::up_to(4.0 * s.force / s.reach(), move |k| {
                let law = Law {
                    states: vec![0.0],
                    begin: Some(Box::new(move |at, z| z[0] = at.q + apart)),
                    rates: Some(Box::new(move |at, dz| dz[0] = (at.q - at.z[0]) / time)),
                    force: Some(Box::new(move |at| -k * (at.q - at.z[0]))),
                    ..Law::default()
                };
                (law, vec![("coupling", k), ("time", time)])
            })
        },
    },
];
