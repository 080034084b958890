//! The diagnosis: finds what a calibrated model leaves unexplained in measured data, traces it to the place and the
//! physical effect that the model lacks, and reports the error before and after.

mod brute_force;
mod candidates;
mod diagnose;
pub mod error_models;
pub mod estimation;
mod fit;
mod latent;
mod motion;
mod records;
mod report;
pub mod selection;
mod settings;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use brute_force::{BruteForce, brute_force};
pub use diagnose::{Options, diagnose};
pub use records::noise_of;
pub use settings::{Coverage, Settings};
