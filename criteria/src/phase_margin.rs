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
    fn reads(&self) -> AnalysisKind {
        AnalysisKind::Linear
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.in_loop()?;
        let value = |system| Ok(capped(feedback(system)?.phase_margin()?, PI));
        Ok(LinearCriterion::boxed(channel, Values::of(Unit::known("rad"), Sense::More).within(-PI, PI), value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, linear, linear_delayed, undefined, value};
    use mops_math as math;

    #[test]
    fn the_margin_of_the_second_order_loop_has_its_closed_form() {
        // w^2/(s (s + 2 z w)): atan(2 z/sqrt(sqrt(1 + 4 z^4) - 2 z^2)).
        for z in [0.1f64, 0.5, 0.9] {
            let margin = value(&PhaseMargin::default(), &linear(&[9.0], &[1.0, 6.0 * z, 0.0])).number;
            let exact = math::atan(2.0 * z / ((1.0 + 4.0 * math::powi(z, 4)).sqrt() - 2.0 * z * z).sqrt());
            assert_near(margin, exact, 1e-11);
        }
    }

    #[test]
    fn a_delay_takes_its_part_until_nothing_is_left() {
        let margin = |delay| value(&PhaseMargin::default(), &linear_delayed(&[1.0], &[1.0, 0.0], delay)).number;
        assert_near(margin(0.3), std::f64::consts::FRAC_PI_2 - 0.3, 1e-12);
        assert_near(margin(1.7), std::f64::consts::FRAC_PI_2 - 1.7, 1e-12);
        // Phase shift to the stability limit, also beyond half a turn.
        assert_near(margin(20.0), std::f64::consts::FRAC_PI_2 - 20.0, 1e-11);
    }

    #[test]
    fn a_loop_that_no_phase_shift_stabilises_has_no_value() {
        let slow = undefined(&PhaseMargin::default(), &linear(&[0.5], &[1.0, -1.0]));
        assert_eq!(slow, "the closed loop is unstable, and no phase shift stabilises it");
    }
}
