//! Plants, one file each.

mod axis;
mod ball;
mod cascade;
mod circuit;
mod crane;
mod drive;
mod driven_pendulum;
mod drop;
mod furuta;
mod jacket;
mod pendulum;
mod places;
mod room;
mod sampled_drive;
mod servo;
mod sled;
mod spring;
mod tanks;
mod torsion;
mod two_masses;

use crate::plant::Plant;

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

/// Returns the plants of cases with a model error in the background.
///
/// Their records are short. The calibration record is as long as the two others together.
pub fn disturbed_plants() -> &'static [&'static Plant] {
    &[&driven_pendulum::PLANT, &two_masses::PLANT, &cascade::PLANT]
}

/// Returns further plants of cases with a model error in the background: one whose controller samples, and two of which
/// a record is one smooth stroke.
pub fn further_plants() -> &'static [&'static Plant] {
    &[&sampled_drive::PLANT, &sled::PLANT, &drop::PLANT]
}
