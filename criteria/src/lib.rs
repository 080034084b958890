//! Criteria of mops, one file each.
//!
//! A study file refers to them by kind; a study written in Rust sets their options:
//!
//! ```
//! use mops_core::study::CriterionBuilder;
//! use mops_criteria::overshoot::Overshoot;
//!
//! let overshoot = Overshoot { signal: "y".into(), target: Some(1.0.into()), ..Overshoot::default() };
//! let criterion = CriterionBuilder::minimise(overshoot, 0.1);
//! ```

pub mod bandwidth;
pub mod control_effort;
pub mod crossover_frequency;
pub mod damping_ratio;
pub mod delay_margin;
pub mod delay_time;
pub mod disk_margin;
pub mod expression;
pub mod final_value;
pub mod fit;
pub mod fit_percent;
pub mod frequency_fit;
mod from_fn;
pub mod gain_margin;
pub mod gain_mask;
pub mod h2_norm;
pub mod hinf_norm;
pub mod iae;
pub mod ise;
pub mod itae;
pub mod itse;
pub mod maximum_complementary_sensitivity;
pub mod maximum_rate;
pub mod maximum_sensitivity;
pub mod model_tracking;
pub mod normalised_error;
pub mod overshoot;
pub mod peak;
pub mod phase_margin;
pub mod rise_time;
pub mod rmse;
pub mod settling_time;
pub mod slowest_pole;
pub mod steady_state_error;
pub mod step_envelope;
pub mod undershoot;

mod common;

use mops_core::catalogue::CriterionKind;

pub use common::{Of, part};
pub use from_fn::{FnCriterion, from_fn};

/// Returns all kinds of criteria. A new kind needs a file and a line here.
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
        CriterionKind::of::<expression::Expression>(),
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
        CriterionKind::of::<gain_margin::GainMargin>(),
        CriterionKind::of::<phase_margin::PhaseMargin>(),
        CriterionKind::of::<delay_margin::DelayMargin>(),
        CriterionKind::of::<disk_margin::DiskMargin>(),
        CriterionKind::of::<maximum_sensitivity::MaximumSensitivity>(),
        CriterionKind::of::<maximum_complementary_sensitivity::MaximumComplementarySensitivity>(),
        CriterionKind::of::<bandwidth::Bandwidth>(),
        CriterionKind::of::<crossover_frequency::CrossoverFrequency>(),
        CriterionKind::of::<damping_ratio::DampingRatio>(),
        CriterionKind::of::<slowest_pole::SlowestPole>(),
        CriterionKind::of::<gain_mask::GainMask>(),
        CriterionKind::of::<h2_norm::H2Norm>(),
        CriterionKind::of::<hinf_norm::HinfNorm>(),
        CriterionKind::of::<frequency_fit::FrequencyFit>(),
    ]
}
