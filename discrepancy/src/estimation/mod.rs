//! Estimates of parameters and initial states under error models, and the evidence of augmented models.

mod compare;
mod curve;
mod errors;
mod estimate;
mod priors;
mod scoring;

pub use compare::{SetFit, SetOfEffects, compare};
pub use curve::FreeCurve;
pub use errors::{ErrorModel, Errors, Motion};
