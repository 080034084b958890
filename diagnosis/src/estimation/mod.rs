//! Estimates of parameters and initial states under error models, and the evidence of augmented models.

mod errors;
mod estimate;
mod priors;
mod scoring;
mod steps;

pub(crate) use errors::Observed;
pub use errors::{Channels, ErrorModel, Errors};
pub(crate) use estimate::{ALLOWANCE, CLEARLY, ITERATIONS, LOOK, ROUND_ITERATIONS, STALLS};
pub use estimate::{Estimate, Estimation};
pub(crate) use priors::{log_choices, nominal_rates, priors};
pub(crate) use scoring::log_determinant;
pub(crate) use steps::{FALL, FOLLOW, TURNS};
