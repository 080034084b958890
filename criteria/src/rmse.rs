//! Root mean square difference from a measurement.

use mops_core::{
    Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value, Variable,
};
use mops_language::Unit;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::{NOT_NEGATIVE, compare};

/// Root mean square error `sqrt(mean_i (y_simulated - y_measured)(t_i)^2)`, in the unit of the signal.
///
/// All samples have equal weight; the simulated curve is evaluated at their times. The criterion is evaluated in the
/// experiments that measure the signal. Less is better. Range: from 0 up; a perfect model gives the noise level. For
/// calibration, minimise `fit` or `normalised-error`, whose residuals least-squares solvers use, and monitor this
/// criterion.
///
/// Source: L. Ljung, System Identification (2nd ed., 1999), chapter 16.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Rmse {
    /// Signal that is compared with its measurement.
    pub signal: String,
}

impl CriterionOptions for Rmse {
    const KIND: &'static str = "rmse";
}

impl CriterionSpec for Rmse {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(Bound { signal: model.signal(&self.signal)?.clone() }))
    }

    fn needs_measurement(&self) -> Option<&str> {
        Some(&self.signal)
    }
}

struct Bound {
    signal: Variable,
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

    fn value(&self, case: &Case, analysis: &Analysis) -> Result<Value, String> {
        let comparison = compare(case, analysis, &self.signal.name)?;
        Ok((comparison.sum_of_squares() / comparison.count()).sqrt().into())
    }
}
