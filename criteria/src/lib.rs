//! Criteria of mops, one file each.
//!
//! A study file names them by kind; a study written in Rust gives their options:
//!
//! ```
//! use mops_core::CriterionDraft;
//! use mops_criteria::overshoot::Overshoot;
//!
//! let overshoot = Overshoot { signal: "y".into(), target: Some(1.0.into()), ..Overshoot::default() };
//! let criterion = CriterionDraft::minimise(overshoot, 0.1);
//! ```

pub mod control_effort;
pub mod delay_time;
pub mod final_value;
pub mod fit;
pub mod fit_percent;
pub mod iae;
pub mod ise;
pub mod itae;
pub mod itse;
pub mod maximum_rate;
pub mod model_tracking;
pub mod normalised_error;
pub mod overshoot;
pub mod peak;
pub mod rise_time;
pub mod rmse;
pub mod settling_time;
pub mod steady_state_error;
pub mod step_envelope;
pub mod undershoot;

mod common;
#[cfg(test)]
mod tests;

use mops_core::CriterionKind;

/// Every kind of criterion. A new one is a file, and a line here.
pub fn kinds() -> Vec<CriterionKind> {
    vec![
        CriterionKind::of::<overshoot::Overshoot>(),
        CriterionKind::of::<undershoot::Undershoot>(),
        CriterionKind::of::<peak::Peak>(),
        CriterionKind::of::<settling_time::SettlingTime>(),
        CriterionKind::of::<rise_time::RiseTime>(),
        CriterionKind::of::<delay_time::DelayTime>(),
        CriterionKind::of::<steady_state_error::SteadyStateError>(),
        CriterionKind::of::<final_value::FinalValue>(),
        CriterionKind::of::<ise::Ise>(),
        CriterionKind::of::<iae::Iae>(),
        CriterionKind::of::<itae::Itae>(),
        CriterionKind::of::<itse::Itse>(),
        CriterionKind::of::<control_effort::ControlEffort>(),
        CriterionKind::of::<maximum_rate::MaximumRate>(),
        CriterionKind::of::<step_envelope::StepEnvelope>(),
        CriterionKind::of::<model_tracking::ModelTracking>(),
        CriterionKind::of::<fit::Fit>(),
        CriterionKind::of::<normalised_error::NormalisedError>(),
        CriterionKind::of::<rmse::Rmse>(),
        CriterionKind::of::<fit_percent::FitPercent>(),
    ]
}
