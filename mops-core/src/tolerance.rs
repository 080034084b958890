//! Accuracy and limits of simulations.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::study::Mistake;

/// Accuracy and limits of a simulation.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", default)]
pub struct Tolerance {
    /// Error per step relative to the state.
    pub relative: f64,
    /// Error per step where the state is small.
    pub absolute: f64,
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
        Self { relative: 1e-8, absolute: 1e-10, max_steps: 100_000, method: IntegrationMethod::Explicit }
    }
}

impl Tolerance {
    /// Checks that the numbers make sense.
    ///
    /// # Errors
    /// A tolerance outside (0, 1), or no steps at all.
    pub fn check(&self) -> Result<(), Mistake> {
        let wrong = |key: &str, fact: String| Mistake::new(key, fact).within("tolerance");
        for (key, value) in [("relative", self.relative), ("absolute", self.absolute)] {
            if !(value > 0.0 && value < 1.0) {
                return Err(wrong(key, format!("a tolerance lies between 0 and 1, not at {value}")));
            }
        }
        if self.max_steps == 0 { Err(wrong("max-steps", "a simulation needs steps".into())) } else { Ok(()) }
    }
}
