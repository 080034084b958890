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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, second_order, simulated, value};
    use mops_math as math;

    /// Returns the step response of `(1 - s)/(s + 1)^2`: smallest at t = 1/2.
    fn inverse(t: f64) -> f64 {
        1.0 - (1.0 + 2.0 * t) * math::exp(-t)
    }

    fn undershoot(target: f64) -> Undershoot {
        Undershoot { signal: "y".into(), target: Some(target.into()), ..Undershoot::default() }
    }

    #[test]
    fn an_inverse_response_undershoots_by_its_closed_form() {
        let exact = 2.0 * math::exp(-0.5) - 1.0;
        assert_near(value(&undershoot(1.0), &simulated(10.0, inverse)).number, exact, 1e-12);
        assert_near(value(&undershoot(-3.0), &simulated(10.0, |t| -3.0 * inverse(t))).number, exact, 1e-12);
        let absolute = Undershoot { absolute: true, ..undershoot(-3.0) };
        assert_near(value(&absolute, &simulated(10.0, |t| -3.0 * inverse(t))).number, 3.0 * exact, 1e-12);
    }

    #[test]
    fn a_response_that_starts_the_right_way_has_none() {
        assert_near(value(&undershoot(1.0), &simulated(10.0, second_order(0.2))).number, 0.0, 1e-15);
    }
}
