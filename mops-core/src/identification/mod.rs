//! The theory of identification as tools: is an input rich enough, which parameters do the data determine, and the
//! linear regressions (FIR, ARX) that answer without a simulation. Pure computation on numbers and Jacobians.

mod blind;
mod covariance;
mod excitation;
mod fitted;
mod insight;
mod least_squares;
mod recursive;
mod regression;
mod report;
mod sensitivity;
mod whiteness;
mod words;

pub use blind::BlindDirection;
pub use covariance::Covariance;
pub use excitation::{Excitation, excitation};
pub use fitted::regressions;
pub use insight::{ExcitationQuestion, excitation_report, excitations, sensitivity_at, spacing};
pub(crate) use insight::{Local, local, report as report_of};
pub use least_squares::{Estimate, least_squares};
pub use recursive::Recursive;
pub use regression::{Regression, RegressionTooShort};
pub use report::{
    DirectionReport, ExcitationReport, RegressionReport, RelativeReport, SensitivityReport, TunerSensitivity,
};
pub use sensitivity::{Coordinate, DIFFERENCES, Sensitivity, TANGENTS};
pub use whiteness::{Whiteness, whiteness};
