//! Slowest pole.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError};
use mops_language::Unit;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Of, Values, poles};

/// Largest real part of all poles, `max Re p`, in 1/s; for a stable system it is negative, and the lower the faster the
/// slowest mode decays.
///
/// With `of = "closed-loop"` the model is the loop transfer function L, and the poles are those of `L/(1 + L)`.
/// Uncontrollable and unobservable poles count too. A pole z of a sampled system counts as `ln(z)/T`, with the sampling
/// period T.
///
/// Less is better. Range: up to 0 for a demand, since an unstable system would meet any positive one; an unstable
/// system has a positive value. Use the pair `good` and `bad` as demand, such as `good = -2`, `bad = 0`. A closed loop
/// with a delay has infinitely many poles, and no value.
///
/// Source: S. P. Boyd, C. H. Barratt, Linear Controller Design (1991), section 7.4 (stability degree).
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct SlowestPole {
    /// Input of the system; may be omitted if there is only one.
    pub input: Option<String>,
    /// Output of the system; may be omitted if there is only one.
    pub output: Option<String>,
    /// System that is evaluated: `system` (the default), or `closed-loop` if the model is a loop transfer function.
    pub of: Of,
}

impl CriterionOptions for SlowestPole {
    const KIND: &'static str = "slowest-pole";
}

impl CriterionSpec for SlowestPole {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.read_as(self.of)?;
        let of = self.of;
        let value = move |system| {
            let poles = poles(&system, of)?;
            Ok(poles.iter().map(|p| p.re).fold(f64::NEG_INFINITY, f64::max).into())
        };
        Ok(LinearCriterion::boxed(
            channel,
            Values::of(Unit::known("1/s"), Sense::Less).within(f64::NEG_INFINITY, 0.0),
            value,
        ))
    }
}
