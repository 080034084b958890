//! Bandwidth.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError};
use mops_language::Unit;
use mops_linear::bandwidth;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Of, Values, feedback};

/// Bandwidth: the lowest `w` with `|G(j w)| = |G(0)|/sqrt 2` (3 dB below), in rad/s, located exactly.
///
/// With `of = "closed-loop"` the model is the loop transfer function L, and `G = L/(1 + L)`.
///
/// Range: above 0. More is better: `demand = "2 Hz"` requires at least 2 Hz (12.6 rad/s). There is no value if the gain
/// at frequency 0 is 0 or infinite, or never falls by 3 dB. There is none either if the closed loop is unstable.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2008), section 11.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Bandwidth {
    /// Input of the system; may be omitted if there is only one.
    pub input: Option<String>,
    /// Output of the system; may be omitted if there is only one.
    pub output: Option<String>,
    /// System that is evaluated: `system` (the default), or `closed-loop` if the model is a loop transfer function.
    pub of: Of,
}

impl CriterionOptions for Bandwidth {
    const KIND: &'static str = "bandwidth";
}

impl CriterionSpec for Bandwidth {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.read_as(self.of)?;
        let of = self.of;
        let value = move |system| match of {
            Of::System => Ok(bandwidth(&system)?.into()),
            Of::ClosedLoop => Ok(feedback(system)?.closed_loop_bandwidth()?.into()),
        };
        Ok(LinearCriterion::boxed(
            channel,
            Values::of(Unit::known("rad/s"), Sense::More).within(0.0, f64::INFINITY),
            value,
        ))
    }
}
