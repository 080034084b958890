//! From a run to its result: conclusions, and the content of `result.json`, its sentences included.
//!
//! | module | content |
//! |---|---|
//! | [`Outcome`], [`conclude`](conclude()) | the result of a run |
//! | [`Findings`] | what tasks add to it |
//! | [`End`] | what is known of the reported point |
//! | [`identification`] | excitation, sensitivities and regressions, as numbers with sentences |
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
