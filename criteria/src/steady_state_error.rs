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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, mistake, quantity, simulated, undefined, value};
    use mops_math as math;

    fn steady(target: f64, window: Option<&str>) -> SteadyStateError {
        SteadyStateError { signal: "y".into(), target: target.into(), window: window.map(quantity) }
    }

    #[test]
    fn a_first_order_lag_has_what_it_still_lacks_at_the_end() {
        let lag = simulated(5.0, |t| 1.0 - math::exp(-t));
        assert_near(value(&steady(1.0, None), &lag).number, math::exp(-5.0), 1e-14);
        // Mean of exp(-t) over [4, 5].
        assert_near(value(&steady(1.0, Some("1 s")), &lag).number, math::exp(-4.0) - math::exp(-5.0), 1e-13);
    }

    #[test]
    fn a_window_of_whole_periods_averages_an_oscillation_out() {
        let ripple = simulated(10.0, |t| 2.1 + math::sin(std::f64::consts::TAU * t));
        assert_near(value(&steady(2.0, Some("3000 ms")), &ripple).number, 0.1, 1e-11);
    }

    #[test]
    fn a_window_must_fit_into_the_simulation() {
        let still = simulated(2.0, |_| 1.0);
        assert_eq!(
            undefined(&steady(1.0, Some("5 s")), &still),
            "the window of 5 s is longer than the simulation of 2 s"
        );
        assert_eq!(mistake(&steady(1.0, Some("0 s"))), "window: `window` must be positive, not 0 s");
    }
}
