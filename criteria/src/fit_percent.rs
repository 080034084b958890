//! Fit to a measurement, in percent.

use mops_core::{Analysis, Case, Criterion, CriterionOptions, CriterionSpec, Interface, Sense, StudyError, Value};
use mops_language::Unit;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::common::compare;

/// Fit `100 (1 - |y_measured - y_simulated| / |y_measured - mean(y_measured)|)`, in percent, with the Euclidean norm
/// over the samples.
///
/// Range: any number up to 100; 100 % is a perfect fit, 0 % no better than the measurement's mean. The criterion is
/// evaluated in the experiments that measure the signal; a constant measurement has no fit. More is better:
/// `demand = 80` requires at least 80 %.
///
/// Source: L. Ljung, System Identification (2nd ed., 1999), chapter 16; the formula is that of `compare` in his System
/// Identification Toolbox.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct FitPercent {
    /// Signal that is compared with its measurement.
    pub signal: String,
}

impl CriterionOptions for FitPercent {
    const KIND: &'static str = "fit-percent";
}

impl CriterionSpec for FitPercent {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(Bound { signal: model.signal(&self.signal)?.name.clone() }))
    }

    fn needs_measurement(&self) -> Option<&str> {
        Some(&self.signal)
    }
}

struct Bound {
    signal: String,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        Unit::known("%")
    }

    fn signals(&self) -> Vec<String> {
        vec![self.signal.clone()]
    }

    fn sense(&self) -> Sense {
        Sense::More
    }

    fn range(&self) -> [f64; 2] {
        [f64::NEG_INFINITY, 100.0]
    }

    fn value(&self, case: &Case, analysis: &Analysis) -> Result<Value, String> {
        let comparison = compare(case, analysis, &self.signal)?;
        let measured = &comparison.channel.values;
        if measured.iter().all(|m| *m == measured[0]) {
            return Err(format!("the measurement of `{}` is constant, so that the fit is undefined", self.signal));
        }
        let mean = measured.iter().sum::<f64>() / comparison.count();
        let variation: f64 = measured.iter().map(|m| (m - mean) * (m - mean)).sum();
        Ok((100.0 * (1.0 - (comparison.sum_of_squares() / variation).sqrt())).into())
    }
}
