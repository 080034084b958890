//! From a run to its result: conclusions, identification, and the content of `result.json`.
//!
//! | module | content |
//! |---|---|
//! | [`Outcome`], [`conclude`](conclude()) | the result of a run |
//! | [`Findings`] | what tasks add to it |
//! | [`End`] | what is known of the reported point |
//! | [`identification`] | sensitivities, covariance of estimates, noise of residuals, excitation, regressions |
//! | [`diagnosis`] | result of a diagnosis |

mod conclude;
pub mod diagnosis;
mod end;
mod findings;
pub mod identification;
mod outcome;

pub use conclude::{Ending, conclude};
pub use end::End;
#[doc(hidden)]
pub use findings::to_value;
pub use findings::{BlockKind, Finding, Findings};
pub use outcome::{
    CalibrationReport, ChannelReport, CriterionReport, Design, ExperimentReport, FailureReport, Outcome,
    ParameterReport, StartReport, TunerReport, criterion_reports, design, result_schema,
};
#[doc(hidden)]
pub use serde_json::Value;
