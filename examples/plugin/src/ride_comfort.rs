//! The criterion `ride-comfort`.

use mops::prelude::*;
use schemars::JsonSchema;
use serde::Deserialize;

/// Root mean square of a signal over the horizon: `sqrt(1/T integral of y^2)`, in the unit of the signal.
///
/// Source: ISO 2631-1:1997, equation 1 (without frequency weighting).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct RideComfort {
    /// Signal, usually an acceleration.
    pub signal: String,
}

impl CriterionOptions for RideComfort {
    const KIND: &'static str = "ride-comfort";
}

impl CriterionSpec for RideComfort {
    fn bind(&self, model: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        let unit = model.signal(&self.signal)?.unit.clone();
        Ok(Box::new(Bound { signal: self.signal.clone(), unit }))
    }
}

/// The criterion on a signal that exists, in its unit.
struct Bound {
    signal: String,
    unit: Unit,
}

impl Criterion for Bound {
    fn unit(&self) -> Unit {
        self.unit.clone()
    }

    fn signals(&self) -> Vec<String> {
        vec![self.signal.clone()]
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let y = analysis.trace(&self.signal);
        Ok((y.integral(|_, y| y * y) / (y.end() - y.start())).sqrt().into())
    }

    fn range(&self) -> [f64; 2] {
        [0.0, f64::INFINITY]
    }
}
