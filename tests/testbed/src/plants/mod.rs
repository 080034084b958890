//! Plants, one file each.

mod axis;
mod ball;
mod circuit;
mod crane;
mod drive;
mod furuta;
mod jacket;
mod pendulum;
mod room;
mod servo;
mod spring;
mod tanks;
mod torsion;

use crate::plant::{Place, Plant};

/// Returns all plants.
pub fn plants() -> &'static [&'static Plant] {
    &[
        &furuta::FREE,
        &furuta::DRIVEN,
        &pendulum::PLANT,
        &servo::PLANT,
        &spring::PLANT,
        &axis::PLANT,
        &ball::PLANT,
        &tanks::PLANT,
        &room::PLANT,
        &crane::PLANT,
        &drive::PLANT,
        &torsion::PLANT,
        &jacket::PLANT,
        &circuit::PLANT,
    ]
}

/// Creates an angle with viscous friction and without a spring in the baseline model.
const fn angle(q: usize, v: usize, rest: f64) -> Place {
    Place::Joint { q, v, rest, angle: true, damped: true, sprung: false }
}

/// Creates a length with viscous friction and without a spring in the baseline model.
const fn length(q: usize, v: usize) -> Place {
    Place::Joint { q, v, rest: 0.0, angle: false, damped: true, sprung: false }
}
