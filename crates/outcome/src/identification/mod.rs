//! Identification tools: persistent excitation, parameter identifiability, and linear regressions (FIR, ARX) without
//! simulation. Pure computation on numbers and Jacobians.

mod alike;
mod blind;
mod coordinate;
mod covariance;
mod excitation;
mod excited;
mod fitted;
mod insight;
mod least_squares;
mod local;
mod noise;
mod pools;
mod records;
mod recursive;
mod regression;
mod report;
mod sensitivity;
mod sentences;
mod whiteness;
mod words;

pub use blind::{BlindDirection, Limit};
pub use coordinate::Coordinate;
pub use covariance::Covariance;
pub use excitation::{Excitation, excitation};
pub use excited::{excitation_report, excitation_words, excitations, spacing};
pub use fitted::regressions;
pub(crate) use insight::report as report_of;
pub use insight::sensitivity_at;
pub use least_squares::{Estimate, least_squares};
pub(crate) use local::{Local, local};
pub use local::{NEGLIGIBLE, Point};
pub use noise::{Noise, Spread};
pub use recursive::Recursive;
pub use regression::{Regression, RegressionTooShort};
pub use report::{
    DirectionReport, ExcitationReport, RegressionReport, RelativeReport, SensitivityReport, TunerSensitivity,
};
pub use sensitivity::{DIFFERENCES, Sensitivity, TANGENTS};
pub use whiteness::{Whiteness, whiteness, whiteness_words};
