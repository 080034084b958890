//! Delay margin of a feedback loop.

use mops_core::{AnalysisKind, Criterion, CriterionOptions, CriterionSpec, Interface, Mistake, Sense};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{Channel, LinearCriterion, Values, capped, feedback, second};

/// The delay margin: the smallest further delay with which the closed loop becomes unstable, `min (pi + arg L(j w))/w` over
/// the frequencies at which `|L(j w)| = 1` (the turn counted from 0 to 2 pi), in s. The model is the loop transfer function L,
/// with unity negative feedback around it.
///
/// Crossings are found by bounds of L over all frequencies, not on a grid; a delay that the model has already enters exactly.
///
/// Range: up to 1e6 s, which stands for an infinite margin. More is better: `demand =
/// "0.1 s"` asks for at least 0.1 s. Where the closed loop is unstable the margin is negative: minus the smallest change of
/// the delay, less or more, that makes it stable; less may be more than the delay there is. It has no value where no change of
/// the delay makes an unstable loop stable.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2008), section 9.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct DelayMargin {
    /// Input of the loop transfer function; the only one where absent.
    pub input: Option<String>,
    /// Output of the loop transfer function; the only one where absent.
    pub output: Option<String>,
}

impl CriterionOptions for DelayMargin {
    const KIND: &'static str = "delay-margin";
}

impl CriterionSpec for DelayMargin {
    fn reads(&self) -> AnalysisKind {
        AnalysisKind::Linear
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, Mistake> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.in_loop()?;
        let value = |system| Ok(capped(feedback(system)?.delay_margin()?, 1e6));
        Ok(LinearCriterion::boxed(channel, Values::of(second(), Sense::More), value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, linear, linear_delayed, value};

    #[test]
    fn the_margin_of_an_integrator_has_its_closed_form_and_a_delay_uses_it_up() {
        // k/s: pi/(2 k).
        let margin = value(&DelayMargin::default(), &linear(&[4.0], &[1.0, 0.0])).number;
        assert_near(margin, std::f64::consts::FRAC_PI_2 / 4.0, 1e-13);
        let left = value(&DelayMargin::default(), &linear_delayed(&[4.0], &[1.0, 0.0], 0.5)).number;
        assert_near(left, std::f64::consts::FRAC_PI_2 / 4.0 - 0.5, 1e-12);
        let late = value(&DelayMargin::default(), &linear_delayed(&[4.0], &[1.0, 0.0], 9.0)).number;
        assert_near(late, std::f64::consts::FRAC_PI_2 / 4.0 - 9.0, 1e-11);
        let never = value(&DelayMargin::default(), &linear(&[0.5], &[1.0, 1.0]));
        assert_eq!(never.number, 1e6);
    }
}
