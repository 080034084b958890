//! Smallest damping ratio of all poles.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError};
use mops_language::Unit;
use mops_linear::Complex;
use mops_math::complex;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Of, Values, poles};

/// Damping ratio of the least damped pole, `min -Re p/|p|`, dimensionless.
///
/// With `of = "closed-loop"` the model is the loop transfer function L, and the poles are those of `L/(1 + L)`.
/// Uncontrollable and unobservable poles count too. A pole z of a sampled system counts as `ln(z)/T`, with the sampling
/// period T.
///
/// Range: -1 to 1; 1 for real stable poles, negative for unstable ones, 0 for a pole at the origin. More is better:
/// `demand = 0.5` requires at least 0.5. A closed loop with a delay has infinitely many poles, and no value.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2008), section 6.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct DampingRatio {
    /// Input of the system; may be omitted if there is only one.
    pub input: Option<String>,
    /// Output of the system; may be omitted if there is only one.
    pub output: Option<String>,
    /// System that is evaluated: `system` (the default), or `closed-loop` if the model is a loop transfer function.
    pub of: Of,
}

impl CriterionOptions for DampingRatio {
    const KIND: &'static str = "damping-ratio";
}

impl CriterionSpec for DampingRatio {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.read_as(self.of)?;
        let of = self.of;
        let damping = |p: &Complex| if complex::norm(*p) == 0.0 { 0.0 } else { -p.re / complex::norm(*p) };
        let value = move |system| Ok(poles(&system, of)?.iter().map(damping).fold(1.0, f64::min).into());
        Ok(LinearCriterion::boxed(channel, Values::of(Unit::one(), Sense::More).within(-1.0, 1.0), value))
    }
}
