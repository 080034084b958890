//! Tests of the simulation kernel.

mod drive;
mod elements;
mod esdirk;
mod friction;
mod integrate;
mod mechanism;
mod record;
mod step;
mod step_size;
