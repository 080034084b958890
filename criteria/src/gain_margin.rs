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
    fn reads(&self) -> AnalysisKind {
        AnalysisKind::Linear
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.in_loop()?;
        let both = self.either_way;
        let value = move |system| Ok(capped(feedback(system)?.gain_margin(both)?, 200.0));
        Ok(LinearCriterion::boxed(channel, Values::of(Unit::known("dB"), Sense::More), value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, linear, linear_delayed, undefined, value};
    use mops_math as math;

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
        assert_eq!((never.number, never.note), (200.0, Some("infinite or above the limit")));
    }

    #[test]
    fn a_margin_between_60_and_200_decibels_is_no_infinite_one() {
        // k exp(-s T)/s: pi/(2 k T).
        for (k, delay) in [(1e-3, 0.5), (1e-5, 2.0), (1e-9, 0.3)] {
            let margin = value(&GainMargin::default(), &linear_delayed(&[k], &[1.0, 0.0], delay));
            assert_near(margin.number, 20.0 * math::log10(std::f64::consts::FRAC_PI_2 / (k * delay)), 1e-8);
            assert!(margin.note.is_none());
        }
    }

    #[test]
    fn an_unstable_loop_has_the_change_that_makes_it_stable_or_no_value() {
        // k/(s + 1)^3 is stable up to k = 8; k/(s - 1) from 1 on; k/(s (s - 1)) never.
        let margin = |numerator: &[f64], denominator: &[f64]| {
            value(&GainMargin::default(), &linear(numerator, denominator)).number
        };
        assert_near(margin(&[800.0], &[1.0, 3.0, 3.0, 1.0]), -40.0, 1e-9);
        assert_near(margin(&[0.01], &[1.0, -1.0]), -40.0, 1e-9);
        assert!(undefined(&GainMargin::default(), &linear(&[1.0], &[1.0, -1.0, 0.0])).contains("no gain change"));
    }
}
