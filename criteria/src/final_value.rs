//! Value of a signal at the end.

use mops_core::{Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Interface, StudyError, Value, Variable};
use mops_language::Unit;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::trace;

/// Final value `y(t_end)`, in the unit of the signal.
///
/// Which values are better depends on the signal: `demand` is an upper limit, the pair `good` and `bad` works in either
/// direction. Range: any number. The criterion serves quantities that a model integrates along its simulation, such as
/// a cost or an energy. For a limit that is zero or negative, use the pair `good` and `bad` instead of `demand`.
///
/// Source: the Mayer form of a cost; A. E. Bryson, Y.-C. Ho, Applied Optimal Control (1975), chapter 2.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct FinalValue {
    /// Signal that is evaluated.
    pub signal: String,
}

impl CriterionOptions for FinalValue {
    const KIND: &'static str = "final-value";
}

impl CriterionSpec for FinalValue {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(Bound { signal: model.signal(&self.signal)?.clone() }))
    }
}

struct Bound {
    signal: Variable,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        self.signal.unit.clone()
    }

    fn signals(&self) -> Vec<String> {
        vec![self.signal.name.clone()]
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        Ok(trace(analysis, &self.signal.name)?.last().into())
    }
}
