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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::testing::{assert_near, bound, measured, simulated, value_in};

    #[test]
    fn the_root_of_the_mean_square_is_that_of_hand_computed_differences() {
        // Differences 1, -1, 2, 0.
        let case = measured(&[0.0, 0.5, 1.7, 3.0], &[-1.0, 1.5, -0.3, 3.0], None);
        let rmse = Rmse { signal: "y".into() };
        let value = value_in(&case, &rmse, &simulated(3.0, |t| t));
        assert_near(value.number, 1.5f64.sqrt(), 1e-12);
        assert!(value.residuals.is_empty());
        assert_eq!(bound(&rmse).unit(), Unit::known("m"));
    }
}
