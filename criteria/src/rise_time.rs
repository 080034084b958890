//! Rise time of a step response.

use mops_core::{Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value};
use mops_language::{Quantity, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, Step, StepOptions, number, second};

/// Rise time `t_high - t_low`, in s, where `t_f` is the first time at which `(y - from)/(target - from) >= f`.
///
/// By default `low` is 0.1 and `high` is 0.9: the rise time from 10 % to 90 % of the step.
///
/// Less is better. Range: from 0 to the length of the simulation. A response that never reaches `high` has no rise time
/// and meets no demand, noted `not risen at the end`.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2nd ed., 2021), section 6.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct RiseTime {
    /// Signal that is measured.
    pub signal: String,
    /// Value at which the signal should settle; by default its value at the end of the simulation.
    pub target: Option<Quantity>,
    /// Value before the step; by default the signal's first value.
    pub from: Option<Quantity>,
    /// Time of the step, 0 s by default; earlier values are ignored.
    pub step_time: Option<Quantity>,
    /// Fraction of the step at which the rise time starts, such as 0.1 (the default) or "10 %".
    pub low: Option<Quantity>,
    /// Fraction of the step at which the rise time ends, at most 1; 0.9 by default.
    pub high: Option<Quantity>,
}

impl CriterionOptions for RiseTime {
    const KIND: &'static str = "rise-time";
}

impl CriterionSpec for RiseTime {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let options = StepOptions {
            signal: &self.signal,
            target: self.target.as_ref(),
            from: self.from.as_ref(),
            step_time: self.step_time.as_ref(),
        };
        let step = options.bind(model)?;
        let low = number("low", self.low.as_ref().unwrap_or(&0.1.into()), &Unit::one())?;
        let high = number("high", self.high.as_ref().unwrap_or(&0.9.into()), &Unit::one())?;
        if !(0.0 <= low && low < high && high <= 1.0) {
            let key = if self.high.is_some() { "high" } else { "low" };
            return Err(StudyError::new(key, format!("a rise from {low} to {high} of the step is impossible"))
                .with_help("choose 0 <= low < high <= 1, such as low = 0.1 and high = 0.9"));
        }
        Ok(Box::new(Bound { step, low, high }))
    }
}

struct Bound {
    step: Step,
    low: f64,
    high: f64,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        second()
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
        let begin = answer.first_reaching(self.low)?.unwrap_or(0.0);
        Ok(match answer.first_reaching(self.high)? {
            Some(end) => answer.note((end - begin).into()),
            None => return answer.not_reached(answer.length(), self.high, "not risen at the end"),
        })
    }
}
