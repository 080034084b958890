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

/// Largest jump between steps, as a fraction of the signal's largest value, that counts as rounding: some ten times the
/// accuracy of recorded signals.
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
