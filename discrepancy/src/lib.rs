//! The discrepancy search: finds what a calibrated model leaves unexplained in measured data, traces it to the place and the
//! physical effect that the model lacks, and reports the error before and after.

mod account;
mod base;
mod brute_force;
mod candidate;
mod diagnose;
mod drawn;
pub mod error_models;
pub mod estimation;
mod family;
mod fit;
mod gap;
mod gaussian;
mod growth;
mod held_out;
mod hygiene;
mod judge;
mod least_squares;
mod locate;
#[cfg(test)]
mod locate_tests;
mod meter;
mod plan;
mod profile;
mod quantum;
mod reduced;
mod removed;
mod repaired;
mod round;
mod screen;
mod search;
pub mod selection;
mod shapes;
mod short_term;
mod stability;
mod standing;
mod start_search;
mod step_search;
mod stopgap;
mod subject;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod trace_of;
mod trajectory;
mod unknown;
mod variant;
mod weigh;
mod windows;

pub use brute_force::{BruteForce, brute_force};
pub use diagnose::{Options, diagnose};
pub use mops_core::diagnosis::{
    Curve, Diagnosis, Evidence, ExperimentError, Found, HangsOn, HeldBack, Noticeable, ParameterMove, Prediction,
    Ranked, Removed, Rival, Stability, Step, StrengthValue, Unexplained, Verdict, WindowErrors, together,
};
