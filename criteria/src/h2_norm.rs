//! H2 norm.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError};
use mops_linear::h2_norm;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Values};

/// H2 norm `sqrt(1/(2 pi) integral |G(j w)|^2 dw)`: root mean square of the output for white noise of unit intensity at
/// the input.
///
/// Equals the square root of the integrated square of the impulse response. The unit is that of the output divided
/// by that of the input, times s^(-1/2), which is omitted.
///
/// Of a sampled system it is `sqrt(T/(2 pi) integral |G(e^(j w T))|^2 dw)` over w from -pi/T to pi/T, with the period
/// T: the root mean square of the output for independent samples of unit variance at the input, such as measurement
/// noise.
///
/// The norm is computed from both Gramians, which must agree. Less is better. Range: from 0 up. There is no value if
/// the system is unstable or its stability is undecided within rounding. There is none either if a continuous system
/// has direct feedthrough, or if the Gramians differ by more than 1e-6 (relative).
///
/// Source: K. Zhou, J. C. Doyle, Essentials of Robust Control (1998), section 4.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct H2Norm {
    /// Input of the system; may be omitted if there is only one.
    pub input: Option<String>,
    /// Output of the system; may be omitted if there is only one.
    pub output: Option<String>,
}

impl CriterionOptions for H2Norm {
    const KIND: &'static str = "h2-norm";
}

impl CriterionSpec for H2Norm {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?;
        let unit = channel.unit.clone();
        Ok(LinearCriterion::boxed(channel, Values::of(unit, Sense::Less).within(0.0, f64::INFINITY), |system| {
            Ok(h2_norm(&system)?.into())
        }))
    }
}
