//! Integral criteria of the control error, which differ in the integrand only.

use mops_core::{Analysis, Case, Criterion, Interface, Sense, StudyError, Value};
use mops_language::Unit;

use super::{NOT_NEGATIVE, Step, StepOptions};

/// Integral `integral f(t, |e|) dt` from the step to the end, with `e = y - target` and `t` counted from the step.
pub struct ErrorIntegral {
    step: Step,
    unit: Unit,
    integrand: fn(f64, f64) -> f64,
}

impl ErrorIntegral {
    /// Creates the criterion with this integrand; its value has the unit `signal^powers[0] s^powers[1]`.
    pub fn bind(
        model: &Interface,
        options: &StepOptions<'_>,
        powers: [i32; 2],
        integrand: fn(f64, f64) -> f64,
    ) -> Result<Box<dyn Criterion>, StudyError> {
        let step = options.bind(model)?;
        let unit = step.unit.power(powers[0], powers[1]);
        Ok(Box::new(Self { step, unit, integrand }))
    }
}

impl Criterion for ErrorIntegral {
    fn unit(&self) -> Unit {
        self.unit.clone()
    }

    fn signals(&self) -> Vec<String> {
        vec![self.step.signal.clone()]
    }

    fn sense(&self) -> Sense {
        Sense::Less
    }

    fn assumption(&self) -> Option<String> {
        self.step.assumption()
    }

    fn range(&self) -> [f64; 2] {
        NOT_NEGATIVE
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let answer = self.step.answer(analysis)?;
        let integrand = |t: f64, e: f64| (self.integrand)(t - answer.time, e);
        Ok(answer.trace.integral_of_deviation(answer.target, integrand).into())
    }
}
