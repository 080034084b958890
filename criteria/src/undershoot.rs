//! Undershoot of a step response: its largest excursion in the wrong direction.

use mops_core::{
    Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Demand, Interface, Sense, StudyError, Value,
    criterion::{Mark, Side},
};
use mops_language::{Quantity, Unit};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, Step, StepOptions};

/// Undershoot `max(0, max_t (from - y)/(target - from))`, dimensionless: 0.2 is 20 % of the step, in the wrong
/// direction.
///
/// A plant with a zero in the right half-plane has an undershoot (inverse response). With `absolute = true` the value
/// is the excursion itself, in the unit of the signal. It is `max(0, from - min_t y)` for a step upwards,
/// `max(0, max_t y - from)` for one downwards.
///
/// Less is better. Range: from 0 up. The whole response counts: a later swing back beyond `from` is an undershoot too.
///
/// Source: S. P. Boyd, C. H. Barratt, Linear Controller Design (1991), section 8.1.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Undershoot {
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

impl CriterionOptions for Undershoot {
    const KIND: &'static str = "undershoot";
}

impl CriterionSpec for Undershoot {
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
        let behind = answer.from - answer.farthest_behind();
        let undershoot = if self.absolute { answer.upwards(behind) } else { behind / answer.height()? };
        Ok(answer.note(undershoot.max(0.0).into()))
    }

    fn marks(&self, demand: &Demand, analysis: &Analysis) -> Vec<Mark> {
        let (Some(limit), Ok(answer)) = (demand.limit(), self.step.answer(analysis)) else { return Vec::new() };
        let behind = if self.absolute { answer.upwards(limit) } else { limit * (answer.target - answer.from) };
        let excluded = if answer.target > answer.from { Side::Below } else { Side::Above };
        vec![self.step.mark("undershoot", answer.time, answer.from - behind, Some(excluded))]
    }
}
