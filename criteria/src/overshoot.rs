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

#[cfg(test)]
mod tests {
    use mops_math as math;
    use std::f64::consts::PI;

    use super::*;
    use crate::common::testing::{assert_near, bound, quantity, second_order, simulated, undefined, value};

    fn overshoot() -> Overshoot {
        Overshoot { signal: "y".into(), target: Some(1.0.into()), ..Overshoot::default() }
    }

    #[test]
    fn a_second_order_system_overshoots_by_its_closed_form() {
        for damping in [0.1, 0.3, 0.5, 0.7, 0.9] {
            let exact = math::exp(-PI * damping / f64::sqrt(1.0 - damping * damping));
            assert_near(value(&overshoot(), &simulated(20.0, second_order(damping))).number, exact, 1e-11);
        }
    }

    #[test]
    fn a_step_downwards_and_later_overshoots_as_much_as_one_upwards_from_zero() {
        let response = second_order(0.3);
        let down = simulated(25.0, |t| if t < 5.0 { 40.0 } else { 40.0 - 2.0 * response(t - 5.0) });
        let exact = math::exp(-PI * 0.3 / f64::sqrt(0.91));
        let mut options = Overshoot { target: Some(38.0.into()), step_time: Some(quantity("5 s")), ..overshoot() };
        assert_near(value(&options, &down).number, exact, 1e-11);
        options.absolute = true;
        assert_near(value(&options, &down).number, 2.0 * exact, 1e-11);
        assert_eq!((bound(&options).unit(), bound(&overshoot()).unit()), (Unit::known("m"), Unit::one()));
    }

    #[test]
    fn a_response_that_never_goes_beyond_has_none() {
        assert_eq!(value(&overshoot(), &simulated(5.0, |t| 1.0 - math::exp(-t))).number, 0.0);
    }

    #[test]
    fn a_signal_that_should_stay_has_an_absolute_overshoot_only() {
        let swing = simulated(10.0, |t| t * math::exp(-t));
        let mut options = Overshoot { target: Some(0.0.into()), ..overshoot() };
        assert_eq!(undefined(&options, &swing), "the step from 0 to 0 has no height");
        options.absolute = true;
        assert_near(value(&options, &swing).number, math::exp(-1.0), 1e-12);
    }

    #[test]
    fn without_a_target_the_last_value_is_it() {
        let options = Overshoot { target: None, ..overshoot() };
        let exact = math::exp(-PI * 0.5 / f64::sqrt(0.75));
        assert_near(value(&options, &simulated(80.0, |t| 3.0 * second_order(0.5)(t))).number, exact, 1e-11);
    }
}
