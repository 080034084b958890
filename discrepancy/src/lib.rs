//! The discrepancy search: finds what a calibrated model leaves unexplained in measured data, traces it to the place and the
//! physical effect that the model lacks, and reports the error before and after.

mod base;
mod brute_force;
mod candidate;
pub mod dev;
mod diagnosis;
mod fit;
mod hygiene;
mod screen;
mod search;
mod subject;
mod trace_of;
mod trajectory;
mod variant;
mod windows;

pub use brute_force::{BruteForce, brute_force};
pub use diagnosis::{
    Curve, Diagnosis, Evidence, ExperimentError, Found, Noticeable, ParameterMove, Prediction, Ranked, Removed, Rival,
    StrengthValue, Unexplained, Verdict,
};
