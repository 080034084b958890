//! The discrepancy search: finds what a calibrated model leaves unexplained in measured data, traces it to the place and the
//! physical effect that the model lacks, and reports the error before and after.

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
mod hygiene;
mod locate;
#[cfg(test)]
mod locate_tests;
mod meter;
mod quantum;
mod report;
mod scene;
pub mod selection;
mod settings;
mod subject;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod trace_of;
mod trajectory;
mod unknown;
mod variant;
mod windows;

pub use brute_force::{BruteForce, brute_force};
pub use diagnose::{Options, diagnose};
pub use hygiene::noise_of;
pub use mops_outcome::diagnosis::{
    Curve, Dependence, Diagnosis, Evidence, ExperimentError, ForecastOf, Found, HangsOn, HeldBack, Noticeable,
    ParameterMove, Prediction, Ranked, Removed, Rival, Rule, Stability, Step, StrengthValue, Unexplained, Verdict,
    WindowErrors, together,
};
pub use settings::{Settings, settings, use_settings};
