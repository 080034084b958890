//! What an identification found, as numbers with sentences: excitation of inputs, sensitivities of tuners, regressions.

mod directions;
mod excitations;
mod regressions;
mod remarks;
mod report;
mod sensitivities;
mod sentences;
mod whiteness;
mod words;

pub use excitations::{excitation_report, excitation_words, excitations, spacing};
pub use regressions::regressions;
pub use report::{
    DirectionReport, ExcitationReport, RegressionReport, RelativeReport, SensitivityReport, TunerSensitivity,
};
pub(crate) use sensitivities::report_of;
pub use sensitivities::sensitivity_at;
pub(crate) use whiteness::whiteness_words;
