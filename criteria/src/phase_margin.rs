//! Phase margin of a feedback loop.

use std::f64::consts::PI;

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError};
use mops_language::Unit;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Values, capped, feedback};

/// Phase margin `min |pi + arg L(j w)|` over the frequencies at which `|L(j w)| = 1`, in rad. The model is the loop
/// transfer function L, with unity negative feedback.
///
/// Crossings are located by bounds of L over all frequencies, not on a grid; a delay of the model is treated exactly.
/// Of several crossings, the one with the smallest phase shift to -1, of either sign, counts.
///
/// Range: up to pi; a stable loop in which `|L|` is never 1 has pi. More is better: `demand = "45 deg"` requires at
/// least 45 deg. For an unstable closed loop the margin is negative: minus the smallest lead or lag, equal at all
/// frequencies above 0, that stabilises it. With a long delay that may exceed half a turn, so that the value is below
/// -pi. There is no value if no lead or lag stabilises an unstable loop, for example with an unstable real pole.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2008), section 9.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct PhaseMargin {
    /// Input of the loop transfer function; may be omitted if there is only one.
    pub input: Option<String>,
    /// Output of the loop transfer function; may be omitted if there is only one.
    pub output: Option<String>,
}

impl CriterionOptions for PhaseMargin {
    const KIND: &'static str = "phase-margin";
}

impl CriterionSpec for PhaseMargin {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.in_loop()?;
        let value = |system| Ok(capped(feedback(system)?.phase_margin()?, PI));
        Ok(LinearCriterion::boxed(channel, Values::of(Unit::known("rad"), Sense::More).within(-PI, PI), value))
    }
}
