//! Gain margin of a feedback loop.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Mistake, Sense, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Values, capped, feedback};

/// The gain margin: the smallest factor `g > 1` with which `g L` meets -1, `20 log10 g` in dB. The model is the loop transfer
/// function L, with unity negative feedback around it.
///
/// Crossings of the negative real axis are found exactly, not on a grid; a delay of the model enters exactly. For a loop that
/// would become unstable with less gain too, `either-way = true` takes the smallest change of the gain, up or down.
///
/// Range: any number of dB. More is better: `demand = "6 dB"` asks for at least 6 dB. Where the closed loop is unstable the margin is negative: minus the smallest change of the gain with which L
/// meets -1, so that the value passes 0 where stability is lost. A margin above 200 dB counts as 200 dB.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2008), section 9.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct GainMargin {
    /// Input of the loop transfer function; the only one where absent.
    pub input: Option<String>,
    /// Output of the loop transfer function; the only one where absent.
    pub output: Option<String>,
    /// `true` counts a smaller gain too, for loops that need a least gain to be stable.
    pub either_way: bool,
}

impl CriterionOptions for GainMargin {
    const KIND: &'static str = "gain-margin";
}

impl CriterionSpec for GainMargin {
    fn reads(&self) -> AnalysisKind {
        AnalysisKind::Linear
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, Mistake> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?;
        let both = self.either_way;
        let value = move |system| Ok(capped(feedback(system)?.gain_margin(both)?, 200.0));
        Ok(LinearCriterion::boxed(channel, Values::of(Unit::known("dB"), Sense::More), value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, linear, linear_delayed, value};
    use mops_core::math;

    #[test]
    fn the_margin_of_a_third_order_lag_has_its_closed_form() {
        // k/(s + 1)^3 is -k/8 at w = sqrt 3.
        for k in [0.5f64, 4.0, 7.0, 9.0] {
            let margin = value(&GainMargin::default(), &linear(&[k], &[1.0, 3.0, 3.0, 1.0])).number;
            assert_near(margin, 20.0 * math::log10(8.0 / k), 1e-10);
        }
    }

    #[test]
    fn the_margin_of_a_delayed_integrator_has_its_closed_form_and_one_without_crossing_is_capped() {
        // exp(-s T)/s: pi/(2 T).
        let late = value(&GainMargin::default(), &linear_delayed(&[1.0], &[1.0, 0.0], 0.2)).number;
        assert_near(late, 20.0 * math::log10(std::f64::consts::PI / 0.4), 1e-9);
        let never = value(&GainMargin::default(), &linear(&[1.0], &[1.0, 1.0]));
        assert_eq!((never.number, never.note), (200.0, Some("infinite, or as good as")));
    }
}
