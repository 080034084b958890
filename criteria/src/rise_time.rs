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

#[cfg(test)]
mod tests {
    use mops_core::criterion::Missed;
    use mops_math as math;

    use super::*;
    use crate::common::testing::{assert_near, mistake, second_order, simulated, value};

    fn rise() -> RiseTime {
        RiseTime { signal: "y".into(), target: Some(1.0.into()), ..RiseTime::default() }
    }

    #[test]
    fn a_first_order_lag_rises_in_its_time_constant_times_the_logarithm_of_nine() {
        let lag = simulated(20.0, |t| 1.0 - math::exp(-t / 2.0));
        assert_near(value(&rise(), &lag).number, 2.0 * math::ln(9.0), 1e-10);
    }

    #[test]
    fn an_oscillation_first_reaches_its_target_by_the_closed_form() {
        let whole = RiseTime { low: Some(0.0.into()), high: Some(1.0.into()), ..rise() };
        for damping in [0.1f64, 0.5, 0.8] {
            let exact = (std::f64::consts::PI - math::acos(damping)) / (1.0 - damping * damping).sqrt();
            assert_near(value(&whole, &simulated(20.0, second_order(damping))).number, exact, 1e-10);
        }
    }

    #[test]
    fn a_step_downwards_and_later_rises_just_as_fast() {
        let down = simulated(20.0, |t| if t < 3.0 { 1.0 } else { math::exp(3.0 - t) });
        let options = RiseTime { target: Some(0.0.into()), step_time: Some(3.0.into()), ..rise() };
        assert_near(value(&options, &down).number, math::ln(9.0), 1e-10);
    }

    #[test]
    fn a_response_that_stays_low_has_not_risen_and_is_the_better_the_nearer_it_comes() {
        let low = RiseTime { from: Some(0.0.into()), ..rise() };
        let at = |level: f64| value(&low, &simulated(10.0, move |_| level));
        assert_near(at(0.5).number, 10.0 * (1.0 + 0.4 / 0.41), 1e-9);
        assert!(at(0.8).number < at(0.5).number && at(-3.0).number > at(0.5).number);
        assert_eq!(
            (at(0.5).missed, at(0.5).note),
            (Some(Missed { horizon: Some(10.0) }), Some("not risen at the end"))
        );
    }

    #[test]
    fn fractions_out_of_order_are_a_mistake() {
        let reversed = RiseTime { low: Some(0.9.into()), high: Some(0.1.into()), ..rise() };
        assert!(mistake(&reversed).starts_with("high: a rise from 0.9 to 0.1 of the step is impossible"));
        assert!(mistake(&RiseTime { low: Some((-0.1).into()), ..rise() }).starts_with("low: "));
    }
}
