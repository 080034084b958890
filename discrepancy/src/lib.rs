//! The discrepancy search: finds what a calibrated model leaves unexplained in measured data, traces it to the place and the
//! physical effect that the model lacks, and reports the error before and after.

mod base;
mod candidate;
mod diagnose;
mod diagnosis;
mod fit;
mod hygiene;
mod repaired;
mod screen;
mod search;
mod subject;
mod trace_of;
mod trajectory;
mod variant;
mod weigh;
mod windows;

pub use diagnose::{Options, diagnose};
pub use diagnosis::{
    Curve, Diagnosis, Evidence, ExperimentError, Found, Noticeable, ParameterMove, Prediction, Ranked, Removed, Rival,
    StrengthValue, Unexplained, Verdict,
};
