//! Accuracy and limits of simulations.

use schemars::JsonSchema;
use serde::de::Error;
use serde::{Deserialize, Deserializer};

use crate::mistake::Mistake;
use crate::unit::{Quantity, Unit};

/// Accuracy and limits of a simulation.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Tolerance {
    /// Error per step relative to the state.
    pub relative: f64,
    /// Error per step of a state near 0, in the unit of the state and the same for all of them; where it is not given, every
    /// state has its own: a hundredth of `relative` times the largest absolute value that the state has had, or its `scale`.
    pub absolute: Option<f64>,
    /// Longest step: a number of seconds, or a time as in "10 ms". Without it a motion that is at rest at all places where a
    /// step looks may be stepped over, such as a pulse `exp(-(time - 500)^2)`.
    #[serde(deserialize_with = "seconds")]
    #[schemars(with = "Option<Quantity>")]
    pub max_step: Option<f64>,
    /// Largest number of steps; a simulation that needs more is a failure.
    pub max_steps: usize,
    /// The method of integration.
    pub method: IntegrationMethod,
}

/// A method of integration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum IntegrationMethod {
    /// Dormand-Prince 5(4): for models whose fastest motion is of interest.
    #[default]
    Explicit,
    /// ESDIRK 4(3), L-stable: for models with motions much faster than what is of interest (heat, reactions, stiff contacts).
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
    /// The tolerance where a study gives none.
    pub const DEFAULT: Self = Self {
        relative: 1e-8,
        absolute: None,
        max_step: None,
        max_steps: 100_000,
        method: IntegrationMethod::Explicit,
    };

    /// Checks that the numbers make sense.
    ///
    /// # Errors
    /// A tolerance outside (0, 1), or no steps at all.
    pub fn check(&self) -> Result<(), Mistake> {
        let wrong = |key: &str, fact: String| Mistake::new(key, fact).within("tolerance");
        for (key, value) in [("relative", Some(self.relative)), ("absolute", self.absolute)] {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && *value < 1.0)) {
                return Err(wrong(key, format!("expected a tolerance between 0 and 1, found {value}")));
            }
        }
        if let Some(step) = self.max_step.filter(|step| !(*step > 0.0 && step.is_finite())) {
            return Err(wrong("max-step", format!("expected a positive time, found {step} s")));
        }
        if self.max_steps == 0 { Err(wrong("max-steps", "a simulation needs steps".into())) } else { Ok(()) }
    }
}
