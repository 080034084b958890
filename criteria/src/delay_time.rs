//! Delay time of a step response.

use mops_core::{Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value};
use mops_language::{Quantity, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, Step, StepOptions, number, second};

/// First time at which `(y - from)/(target - from) >= level`, counted from the step, in s; `level` is 0.5 by default.
///
/// Less is better. Range: from 0 to the length of the simulation. A response that never reaches the level has no delay
/// time and meets no demand, noted `level not reached`.
///
/// Source: K. Ogata, Modern Control Engineering (5th ed., 2010), section 5-3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct DelayTime {
    /// Signal that is measured.
    pub signal: String,
    /// Value at which the signal should settle; by default its value at the end of the simulation.
    pub target: Option<Quantity>,
    /// Value before the step; by default the signal's first value.
    pub from: Option<Quantity>,
    /// Time of the step, from which the delay counts; 0 s by default.
    pub step_time: Option<Quantity>,
    /// Fraction of the step, above 0 and at most 1, such as 0.5 (the default) or "50 %".
    pub level: Option<Quantity>,
}

impl CriterionOptions for DelayTime {
    const KIND: &'static str = "delay-time";
}

impl CriterionSpec for DelayTime {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let options = StepOptions {
            signal: &self.signal,
            target: self.target.as_ref(),
            from: self.from.as_ref(),
            step_time: self.step_time.as_ref(),
        };
        let step = options.bind(model)?;
        let level = number("level", self.level.as_ref().unwrap_or(&0.5.into()), &Unit::one())?;
        if !(0.0 < level && level <= 1.0) {
            return Err(StudyError::new("level", format!("`level` must be above 0 and at most 1, not {level}")));
        }
        Ok(Box::new(Bound { step, level }))
    }
}

struct Bound {
    step: Step,
    level: f64,
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
        match answer.first_reaching(self.level)? {
            Some(time) => Ok(answer.note(time.into())),
            None => answer.not_reached(answer.length(), self.level, "level not reached"),
        }
    }
}
