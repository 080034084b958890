//! Hinf norm.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError};
use mops_linear::hinf_norm;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Values};

/// Hinf norm `max_w |G(j w)|`: the largest amplification of any sine, in the unit of the output divided by that of the
/// input.
///
/// For the linearised closed loop from setpoint to actuator it is the largest control effort.
///
/// The peak is located by bounds over all frequencies, not on a grid. Less is better. Range: from 0 up. There is no
/// value if the system is unstable or its stability is undecided within rounding.
///
/// Source: K. Zhou, J. C. Doyle, Essentials of Robust Control (1998), section 4.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct HinfNorm {
    /// Input of the system; may be omitted if there is only one.
    pub input: Option<String>,
    /// Output of the system; may be omitted if there is only one.
    pub output: Option<String>,
}

impl CriterionOptions for HinfNorm {
    const KIND: &'static str = "hinf-norm";
}

impl CriterionSpec for HinfNorm {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?;
        let unit = channel.unit.clone();
        Ok(LinearCriterion::boxed(channel, Values::of(unit, Sense::Less).within(0.0, f64::INFINITY), |system| {
            Ok(hinf_norm(&system)?.gain.into())
        }))
    }
}
