//! Gain margin of a feedback loop.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError};
use mops_language::Unit;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Values, capped, feedback};

/// Gain margin: the smallest factor `g > 1` at which `g L` meets -1, `20 log10 g` in dB. The model is the loop transfer
/// function L, with unity negative feedback.
///
/// Crossings of the negative real axis are located by bounds of L over all frequencies, not on a grid. A delay of the
/// model is treated exactly. For a loop that would also become unstable with less gain, `either-way = true` gives the
/// smallest gain change of either sign.
///
/// Range: -200 to 200 dB. More is better: `demand = "6 dB"` requires at least 6 dB. For an unstable closed loop the
/// margin is negative: minus the smallest gain change of either sign that stabilises it. A crossing that only leads to
/// other unstable poles does not count. Hence the value rises to 0 towards stability, and is 0 nowhere else. A margin
/// above 200 dB counts as 200 dB. There is no value if no gain change of up to 200 dB stabilises an unstable loop.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2008), section 9.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct GainMargin {
    /// Input of the loop transfer function; may be omitted if there is only one.
    pub input: Option<String>,
    /// Output of the loop transfer function; may be omitted if there is only one.
    pub output: Option<String>,
    /// If `true`, a reduction of the gain counts too, for loops that need a minimum gain to be stable.
    pub either_way: bool,
}

impl CriterionOptions for GainMargin {
    const KIND: &'static str = "gain-margin";
}

impl CriterionSpec for GainMargin {
    fn reads(&self) -> Option<AnalysisKind> {
        Some(AnalysisKind::Linear)
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.in_loop()?;
        let both = self.either_way;
        let value = move |system| Ok(capped(feedback(system)?.gain_margin(both)?, MOST));
        let values = Values::of(Unit::known("dB"), Sense::More).within(-MOST, MOST);
        Ok(LinearCriterion::boxed(channel, values, value))
    }
}

/// Largest margin, dB: one of a loop that no gain destabilises is infinite.
const MOST: f64 = 200.0;
