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
    fn reads(&self) -> AnalysisKind {
        AnalysisKind::Linear
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let channel = Channel::bind(model, self.input.as_ref(), self.output.as_ref())?.in_loop()?;
        Ok(LinearCriterion::boxed(channel, Values::of(Unit::one(), Sense::Less).within(0.0, f64::INFINITY), |system| {
            Ok(feedback(system)?.peak_complementary()?.into())
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, linear, linear_delayed, value};

    #[test]
    fn with_an_integrator_it_is_one_at_least_however_low_the_gain_and_whatever_the_delay() {
        for (k, delay) in [(0.1, 0.2), (1e-3, 2.0), (1e-6, 0.01), (1e-9, 5.0)] {
            let loops = [linear_delayed(&[k], &[1.0, 0.0], delay), linear_delayed(&[k], &[1.0, 8.0, 20.0, 0.0], delay)];
            for l in loops {
                assert_near(value(&MaximumComplementarySensitivity::default(), &l).number, 1.0, 1e-12);
            }
        }
    }

    #[test]
    fn the_peak_of_the_second_order_loop_has_its_closed_form() {
        // w^2/(s (s + 2 z w)): 1/(2 z sqrt(1 - z^2)).
        for z in [0.05f64, 0.3, 0.6] {
            let peak = value(&MaximumComplementarySensitivity::default(), &linear(&[9.0], &[1.0, 6.0 * z, 0.0])).number;
            assert_near(peak, 0.5 / (z * (1.0 - z * z).sqrt()), 1e-7);
        }
    }
}
