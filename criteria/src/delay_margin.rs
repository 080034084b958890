//! Delay margin of a feedback loop.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Values, capped, feedback, second};

/// Delay margin: the smallest additional delay that makes the closed loop unstable, `min (pi + arg L(j w))/w` over the
/// frequencies at which `|L(j w)| = 1`, in s.
///
/// The angle `pi + arg L` counts from 0 to 2 pi. The model is the loop transfer function L, with unity negative
/// feedback. Crossings are located by bounds of L over all frequencies, not on a grid; an existing delay of the model
/// is treated exactly.
///
/// Range: up to 1e6 s, which represents an infinite margin. More is better: `demand = "0.1 s"` requires at least 0.1 s.
/// For an unstable closed loop the margin is negative: minus the smallest change of the delay, of either sign, that
/// stabilises it. A reduction may exceed the existing delay. There is no value if no change of the delay stabilises an
/// unstable loop.
///
/// For a sampled loop it is the delay of the sampled values: exact for whole periods, otherwise that of values without
/// frequencies above half of the sampling frequency.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2008), section 9.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct DelayMargin {
    /// Input of the loop transfer function; may be omitted if there is only one.
    pub input: Option<String>,
    /// Output of the loop transfer function; may be omitted if there is only one.
    pub output: Option<String>,
}

impl CriterionOptions for DelayMargin {
    const KIND: &'static str = "delay-margin";
}

impl CriterionSpec for DelayMargin {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.in_loop()?;
        let value = |system| Ok(capped(feedback(system)?.delay_margin()?, MOST));
        let values = Values::of(second(), Sense::More).within(f64::NEG_INFINITY, MOST);
        Ok(LinearCriterion::boxed(channel, values, value))
    }
}

/// Largest margin, s: one of a loop that no delay destabilises is infinite.
const MOST: f64 = 1e6;
