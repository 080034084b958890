//! Integral of the squared error.

use mops_core::{Criterion, CriterionOptions, CriterionSpec, Interface, StudyError};
use mops_language::Quantity;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{ErrorIntegral, StepOptions};

/// Integral of the squared error, `integral (y - target)^2 dt` from the step to the end, in signal^2 s.
///
/// Large errors, hence the initial part of a response, have a high weight: the result is fast, but lightly damped.
///
/// Less is better. Range: from 0 up. The integral is that of the curve, exact up to rounding.
///
/// Source: D. Graham, R. C. Lathrop, The synthesis of "optimum" transient response: criteria and standard forms,
/// Transactions of the AIEE 72 (1953), part II, 273-288.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Ise {
    /// Signal that is measured.
    pub signal: String,
    /// Value that the signal should have; by default its value at the end of the simulation.
    pub target: Option<Quantity>,
    /// Time of the step, from which the integral is taken; 0 s by default.
    pub step_time: Option<Quantity>,
}

impl CriterionOptions for Ise {
    const KIND: &'static str = "ise";
}

impl CriterionSpec for Ise {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let options = StepOptions {
            signal: &self.signal,
            target: self.target.as_ref(),
            from: None,
            step_time: self.step_time.as_ref(),
        };
        ErrorIntegral::bind(model, &options, [2, 1], |_, e| e * e)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, bound, simulated, value};
    use mops_math as math;

    fn ise() -> Ise {
        Ise { signal: "y".into(), target: Some(1.0.into()), ..Ise::default() }
    }

    #[test]
    fn a_first_order_lag_has_half_its_time_constant() {
        let (lag, length) = (simulated(12.0, |t| 1.0 - math::exp(-t / 3.0)), 12.0f64);
        assert_near(value(&ise(), &lag).number, 1.5 * (1.0 - math::exp(-2.0 * length / 3.0)), 1e-12);
        assert_eq!(bound(&ise()).unit(), mops_language::Unit::known("m2 s"));
    }

    #[test]
    fn what_comes_before_the_step_does_not_count() {
        let late = simulated(42.0, |t| if t < 2.0 { 0.0 } else { 1.0 - math::exp(2.0 - t) });
        assert_near(value(&Ise { step_time: Some(2.0.into()), ..ise() }, &late).number, 0.5, 1e-12);
        assert_near(value(&ise(), &late).number, 2.5, 1e-12);
    }
}
