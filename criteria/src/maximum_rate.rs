//! Largest rate of change of a signal.

use mops_core::{
    Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value, Variable,
};
use mops_language::Unit;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, trace};

/// Maximum rate `max_t |dy/dt|` over the whole simulation, in the unit of the signal per second.
///
/// Less is better. Range: from 0 up. The derivative is that of the curve on each step of the simulation. If the signal
/// jumps, as a controller's output does on a step of its reference, the rate is infinite and the criterion has no
/// value. In that case use a continuous signal, or filter this one in the model. The initial value does not count as a
/// jump.
///
/// Source: S. P. Boyd, C. H. Barratt, Linear Controller Design (1991), chapter 8 (slew-rate limits).
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct MaximumRate {
    /// Signal that is measured.
    pub signal: String,
}

impl CriterionOptions for MaximumRate {
    const KIND: &'static str = "maximum-rate";
}

impl CriterionSpec for MaximumRate {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(Bound { signal: model.signal(&self.signal)?.clone() }))
    }
}

struct Bound {
    signal: Variable,
}

/// Largest jump between steps, as a fraction of the signal's largest value, that counts as rounding: some ten times the accuracy of recorded
/// signals.
const ROUNDING: f64 = 1e-6;

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        self.signal.unit.power(1, -1)
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
        let jump = trace.largest_jump();
        if jump > ROUNDING * trace.maximum().0.max(-trace.minimum().0) {
            return Err(format!(
                "`{}` jumps by {}, so that its rate is infinite: use a continuous signal, or filter this one",
                self.signal.name,
                self.signal.unit.amount(jump)
            ));
        }
        let rate = trace.derivative();
        Ok(rate.maximum().0.max(-rate.minimum().0).into())
    }
}

#[cfg(test)]
mod tests {
    use mops_core::Trace;
    use mops_math as math;

    use super::*;
    use crate::common::testing::{analysis, assert_near, bound, simulated, undefined, value};

    fn rate() -> MaximumRate {
        MaximumRate { signal: "y".into() }
    }

    #[test]
    fn the_largest_rate_is_that_of_the_curve_whichever_its_sign() {
        assert_near(value(&rate(), &simulated(9.0, |t| 2.0 * math::sin(3.0 * t))).number, 6.0, 1e-8);
        assert_near(value(&rate(), &simulated(9.0, |t| 5.0 * math::exp(-2.0 * t))).number, 10.0, 1e-6);
        assert_eq!(bound(&rate()).unit(), Unit::known("m/s"));
    }

    #[test]
    fn a_kink_has_the_larger_of_its_two_rates() {
        let mut trace = Trace::starting_at(0.0, 2);
        trace.push_polynomial(2.0, [0.0, 1.0, 0.0, 0.0, 0.0]);
        trace.push_polynomial(3.0, [1.0, -4.0, 0.0, 0.0, 0.0]);
        assert_eq!(value(&rate(), &analysis(&trace)).number, 4.0);
    }

    #[test]
    fn a_jump_has_no_rate() {
        let mut step = Trace::starting_at(0.0, 2);
        step.push(1.0, [0.0; 5]);
        step.push(2.0, [3.0; 5]);
        assert_eq!(
            undefined(&rate(), &analysis(&step)),
            "`y` jumps by 3 m, so that its rate is infinite: use a continuous signal, or filter this one"
        );
    }
}
