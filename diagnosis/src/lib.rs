//! Diagnosis of a calibrated model: where and on what coordinate measured data contradict it, which physical effect it
//! lacks, and by how much that effect reduces the error on calibration and held-out data.

mod brute_force;
mod candidates;
mod diagnose;
mod error_models;
mod estimation;
mod fit;
mod latent;
mod motion;
mod records;
mod report;
mod selection;
mod settings;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use brute_force::{BruteForce, brute_force};
pub use diagnose::{Options, diagnose};
pub use records::noise_of;
pub use settings::{Coverage, Settings};
