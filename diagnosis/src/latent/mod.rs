//! Latent force: what is missing, without a catalogue. Free curves show on which coordinate and at which place it
//! depends; smoothed forces and output errors show its course.

mod coordinates;
mod curve;
mod input;
#[cfg(test)]
mod tests;

pub use input::latent_inputs;
