//! Overshoot of a step response.

use mops_core::{
    Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Demand, Interface, Sense, StudyError, Value,
    criterion::{Mark, Side},
};
use mops_language::{Quantity, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, Step, StepOptions};

/// Overshoot `max(0, max_t (y - target)/(target - from))`, dimensionless: 0.05 is 5 % of the step.
///
/// With `absolute = true` the value is the excursion itself, in the unit of the signal. It is
/// `max(0, max_t y - target)` for a step upwards, `max(0, target - min_t y)` for one downwards. If `target` and `from`
/// are equal, the step counts as upwards, so that the option also serves a signal that should stay constant. The
/// relative overshoot of such a signal is undefined.
///
/// Less is better. Range: from 0 up. The maximum is that of the curve, not of samples. Simulate long enough to include
/// it.
///
/// Source: K. J. Astrom, R. M. Murray, Feedback Systems (2nd ed., 2021), section 6.3.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Overshoot {
    /// Signal that is measured.
    pub signal: String,
    /// Value at which the signal should settle; by default its value at the end of the simulation.
    pub target: Option<Quantity>,
    /// Value before the step; by default the signal's first value.
    pub from: Option<Quantity>,
    /// Time of the step, 0 s by default; earlier values are ignored.
    pub step_time: Option<Quantity>,
    /// If `true`, the excursion in the unit of the signal instead of a fraction of the step.
    #[serde(default)]
    pub absolute: bool,
}

impl CriterionOptions for Overshoot {
    const KIND: &'static str = "overshoot";
}

impl CriterionSpec for Overshoot {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let options = StepOptions {
            signal: &self.signal,
            target: self.target.as_ref(),
            from: self.from.as_ref(),
            step_time: self.step_time.as_ref(),
        };
        Ok(Box::new(Bound { step: options.bind(model)?, absolute: self.absolute }))
    }
}

struct Bound {
    step: Step,
    absolute: bool,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        if self.absolute { self.step.unit.difference() } else { Unit::one() }
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
        let beyond = answer.farthest_ahead() - answer.target;
        let overshoot = if self.absolute { answer.upwards(beyond) } else { beyond / answer.height()? };
        Ok(answer.note(overshoot.max(0.0).into()))
    }

    fn marks(&self, demand: &Demand, analysis: &Analysis) -> Vec<Mark> {
        let (Some(limit), Ok(answer)) = (demand.limit(), self.step.answer(analysis)) else { return Vec::new() };
        let beyond = if self.absolute { answer.upwards(limit) } else { limit * (answer.target - answer.from) };
        let excluded = if answer.target > answer.from { Side::Above } else { Side::Below };
        vec![self.step.mark("overshoot", answer.time, answer.target + beyond, Some(excluded))]
    }
}
