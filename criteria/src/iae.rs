//! Integral of the absolute error.

use mops_core::{Criterion, CriterionOptions, CriterionSpec, Interface, StudyError};
use mops_language::Quantity;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{ErrorIntegral, StepOptions};

/// Integral of the absolute error, `integral |y - target| dt` from the step to the end, in signal s.
///
/// All errors have equal weight, large or small, early or late.
///
/// Less is better. Range: from 0 up. The integral is that of the curve, split where `y` crosses its target, exact up to
/// rounding.
///
/// Source: D. Graham, R. C. Lathrop, The synthesis of "optimum" transient response: criteria and standard forms,
/// Transactions of the AIEE 72 (1953), part II, 273-288.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Iae {
    /// Signal that is measured.
    pub signal: String,
    /// Value that the signal should have; by default its value at the end of the simulation.
    pub target: Option<Quantity>,
    /// Time of the step, from which the integral is taken; 0 s by default.
    pub step_time: Option<Quantity>,
}

impl CriterionOptions for Iae {
    const KIND: &'static str = "iae";
}

impl CriterionSpec for Iae {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let options = StepOptions {
            signal: &self.signal,
            target: self.target.as_ref(),
            from: None,
            step_time: self.step_time.as_ref(),
        };
        ErrorIntegral::bind(model, &options, [1, 1], |_, e| e)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, bound, simulated, value};
    use mops_math as math;

    fn iae() -> Iae {
        Iae { signal: "y".into(), target: Some(1.0.into()), ..Iae::default() }
    }

    #[test]
    fn a_first_order_lag_has_its_time_constant() {
        let (lag, length) = (simulated(12.0, |t| 1.0 - math::exp(-t / 3.0)), 12.0f64);
        assert_near(value(&iae(), &lag).number, 3.0 * (1.0 - math::exp(-length / 3.0)), 1e-12);
        assert_eq!(bound(&iae()).unit(), mops_language::Unit::known("m s"));
    }

    #[test]
    fn an_oscillation_counts_on_both_sides() {
        let swing = simulated(40.0, |t| 1.0 + math::exp(-t) * math::sin(t));
        assert_near(value(&iae(), &swing).number, 0.5 / math::tanh(std::f64::consts::FRAC_PI_2), 1e-12);
    }

    #[test]
    fn without_a_target_the_last_value_is_it() {
        let lag = simulated(60.0, |t| 5.0 - 2.0 * math::exp(-t));
        assert_near(value(&Iae { target: None, ..iae() }, &lag).number, 2.0, 1e-12);
    }
}
