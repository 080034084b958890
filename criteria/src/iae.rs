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
