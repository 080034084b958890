//! Estimates of parameters and initial states under error models, and the evidence of augmented models.

mod curve;
mod errors;
mod estimate;
mod priors;
mod scoring;
mod steps;

pub use errors::{Channels, ErrorModel, Errors, Motion};
pub use estimate::{Estimate, Estimation};
pub(crate) use priors::{log_choices, nominal_rates, priors};
pub(crate) use steps::FALL;
