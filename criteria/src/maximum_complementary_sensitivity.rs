//! Maximum complementary sensitivity of a feedback loop.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError};
use mops_language::Unit;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Values, feedback};

/// Maximum complementary sensitivity `Mt = max_w |L(j w)/(1 + L(j w))|`, dimensionless: the resonance peak of the
/// closed loop.
///
/// The model is the loop transfer function L, with unity negative feedback. The peak is located by bounds of L over all
/// frequencies from 0 to infinity, with or without delay, not on a grid.
///
/// Less is better. Range: from 0 up; 1 to 1.5 is usual. There is no value if the closed loop is unstable.
///
/// Source: K. J. Astrom, T. Hagglund, PID Controllers, 2nd edition (1995), section 4.5.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct MaximumComplementarySensitivity {
    /// Input of the loop transfer function; may be omitted if there is only one.
    pub input: Option<String>,
    /// Output of the loop transfer function; may be omitted if there is only one.
    pub output: Option<String>,
}

impl CriterionOptions for MaximumComplementarySensitivity {
    const KIND: &'static str = "maximum-complementary-sensitivity";
}

impl CriterionSpec for MaximumComplementarySensitivity {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.in_loop()?;
        Ok(LinearCriterion::boxed(channel, Values::of(Unit::one(), Sense::Less).within(0.0, f64::INFINITY), |system| {
            Ok(feedback(system)?.peak_complementary()?.into())
        }))
    }
}
