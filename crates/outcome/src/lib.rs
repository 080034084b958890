//! From a run to its result: conclusions, identification, and the content of `result.json`.

mod conclude;
mod derivatives;
pub mod diagnosis;
mod end;
pub mod identification;
mod jumps;
mod outcome;
pub mod robustness;
mod slopes;
mod trade_offs;
mod uncertainty;

pub use conclude::{Ending, conclude};
pub use derivatives::{Beyond, Contradiction, DerivativesReport};
pub use end::End;
pub use jumps::{AwayReport, JumpReport, JumpsReport, MovedKind, ON_JUMP, WITHIN as JUMPS_WITHIN};
pub use outcome::{
    CalibrationReport, ChannelReport, CriterionReport, Design, ExcitationFindings, ExperimentReport, FailureReport,
    Findings, Outcome, ParameterReport, StartReport, SweepAxis, SweepReport, TunerReport, criterion_reports,
    result_schema,
};
pub use slopes::{CriterionSlopes, SlopesReport};
pub use trade_offs::{Certified, Exchange, FrontCriterion, FrontPoint, TradeOffs};
pub use uncertainty::{BandReport, BootstrapParameter, BootstrapReport, ProfileReport, UncertaintyReport};
