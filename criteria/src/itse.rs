//! Integral of time and squared error.

use mops_core::{Criterion, CriterionOptions, CriterionSpec, Interface, StudyError};
use mops_language::Quantity;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{ErrorIntegral, StepOptions};

/// Integral of time and squared error, `integral t (y - target)^2 dt` from the step to the end, `t` counted from the
/// step, in signal^2 s^2.
///
/// A compromise between ISE and ITAE: the initial error and small errors have a low weight.
///
/// Less is better. Range: from 0 up. The integral is that of the curve, exact up to rounding.
///
/// Source: D. Graham, R. C. Lathrop, The synthesis of "optimum" transient response: criteria and standard forms,
/// Transactions of the AIEE 72 (1953), part II, 273-288.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Itse {
    /// Signal that is measured.
    pub signal: String,
    /// Value that the signal should have; by default its value at the end of the simulation.
    pub target: Option<Quantity>,
    /// Time of the step, from which `t` counts and the integral is taken; 0 s by default.
    pub step_time: Option<Quantity>,
}

impl CriterionOptions for Itse {
    const KIND: &'static str = "itse";
}

impl CriterionSpec for Itse {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let options = StepOptions {
            signal: &self.signal,
            target: self.target.as_ref(),
            from: None,
            step_time: self.step_time.as_ref(),
        };
        ErrorIntegral::bind(model, &options, [2, 2], |t, e| t * e * e)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, bound, simulated, value};
    use mops_math as math;

    fn itse() -> Itse {
        Itse { signal: "y".into(), target: Some(1.0.into()), ..Itse::default() }
    }

    #[test]
    fn a_first_order_lag_has_a_quarter_of_its_time_constant_squared() {
        let (lag, ratio) = (simulated(12.0, |t| 1.0 - math::exp(-t / 3.0)), 8f64);
        assert_near(value(&itse(), &lag).number, 2.25 * (1.0 - math::exp(-ratio) * (1.0 + ratio)), 1e-12);
        assert_eq!(bound(&itse()).unit(), mops_language::Unit::known("m2 s2"));
    }

    #[test]
    fn the_time_counts_from_the_step() {
        let late = simulated(42.0, |t| if t < 2.0 { 0.0 } else { 1.0 - math::exp(2.0 - t) });
        assert_near(value(&Itse { step_time: Some(2.0.into()), ..itse() }, &late).number, 0.25, 1e-12);
    }
}
