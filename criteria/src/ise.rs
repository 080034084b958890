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
