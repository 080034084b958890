//! Steady-state error.

use mops_core::{
    Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value, Variable,
};
use mops_language::{Quantity, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, number, part, positive, second, trace};

/// Steady-state error `|y(t_end) - target|`, in the unit of the signal; with a `window` of length w,
/// `|mean of y over [t_end - w, t_end] - target|`.
///
/// Less is better. Range: from 0 up. The mean is taken before the absolute value, so that a window of whole periods
/// averages out a persistent oscillation.
///
/// Source: K. Ogata, Modern Control Engineering (5th ed., 2010), section 5-8.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct SteadyStateError {
    /// Signal that is measured.
    pub signal: String,
    /// Value at which the signal should settle.
    pub target: Quantity,
    /// Length of the final part of the simulation over which the signal is averaged; by default its last value only.
    pub window: Option<Quantity>,
}

impl CriterionOptions for SteadyStateError {
    const KIND: &'static str = "steady-state-error";
}

impl CriterionSpec for SteadyStateError {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let signal = model.signal(&self.signal)?.clone();
        let target = number("target", &self.target, &signal.unit)?;
        let window = positive("window", self.window.as_ref(), &second())?;
        Ok(Box::new(Bound { signal, target, window }))
    }
}

struct Bound {
    signal: Variable,
    target: f64,
    window: Option<f64>,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        self.signal.unit.difference()
    }

    fn signals(&self) -> Vec<String> {
        vec![self.signal.name.clone()]
    }

    fn sense(&self) -> Sense {
        Sense::Less
    }

    fn range(&self) -> [f64; 2] {
        NOT_NEGATIVE
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let trace = trace(analysis, &self.signal.name)?;
        let Some(window) = self.window else { return Ok((trace.last() - self.target).abs().into()) };
        let (length, end) = (trace.end() - trace.start(), trace.end());
        if window > length {
            return Err(format!("the window of {window} s is longer than the simulation of {length} s"));
        }
        let excess = part(trace, &[end - window, end], |_, y| y - self.target).integral(|_, e| e);
        Ok((excess / window).abs().into())
    }
}
