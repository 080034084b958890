//! Accuracy and limits of simulations.

use mops_language::{Quantity, Unit};
use schemars::JsonSchema;
use serde::de::Error;
use serde::{Deserialize, Deserializer};

use crate::error::StudyError;

/// Accuracy and limits of a simulation.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Tolerance {
    /// Relative error tolerance per step.
    pub relative: f64,
    /// Absolute error tolerance per step, in the unit of the state and identical for all states. By default every state
    /// has its own: a hundredth of `relative` times the largest absolute value of the state so far, or its `scale`.
    pub absolute: Option<f64>,
    /// Maximum step size: a number of seconds, or a time such as "10 ms". Without a maximum, a step may miss a short
    /// motion that is at rest at all evaluated times, such as a pulse `exp(-(time - 500)^2)`.
    #[serde(deserialize_with = "seconds")]
    #[schemars(with = "Option<Quantity>")]
    pub max_step: Option<f64>,
    /// Maximum number of steps; a simulation that exceeds it fails.
    pub max_steps: usize,
    /// Integration method.
    pub method: IntegrationMethod,
}

/// Integration method.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum IntegrationMethod {
    /// Dormand-Prince 5(4), explicit: for models whose fastest dynamics are of interest.
    #[default]
    Explicit,
    /// ESDIRK 4(3), L-stable: for models with dynamics much faster than those of interest (heat, reactions, stiff
    /// contacts).
    Stiff,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self::DEFAULT
    }
}

fn seconds<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    let quantity = Quantity::deserialize(deserializer)?;
    quantity.to(&Unit::known("s")).map(Some).map_err(D::Error::custom)
}

impl Tolerance {
    /// Default tolerance.
    pub const DEFAULT: Self = Self {
        relative: 1e-8,
        absolute: None,
        max_step: None,
        max_steps: 100_000,
        method: IntegrationMethod::Explicit,
    };

    /// Checks the tolerance.
    ///
    /// # Errors
    /// Returns an error for a tolerance outside (0, 1), a maximum step size that is not positive, or no steps at all.
    pub fn check(&self) -> Result<(), StudyError> {
        let wrong = |key: &str, fact: String| StudyError::new(key, fact).within("tolerance");
        for (key, value) in [("relative", Some(self.relative)), ("absolute", self.absolute)] {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && *value < 1.0)) {
                return Err(wrong(key, format!("expected a tolerance between 0 and 1, found {value}")));
            }
        }
        if let Some(step) = self.max_step.filter(|step| !(*step > 0.0 && step.is_finite())) {
            return Err(wrong("max-step", format!("expected a positive time, found {step} s")));
        }
        if self.max_steps == 0 { Err(wrong("max-steps", "expected at least 1 step, found 0".into())) } else { Ok(()) }
    }
}
