//! `task = "monte-carlo"`: distributions of the criteria over uncertain parameters.

use mops_statistics::Sampling;
use schemars::JsonSchema;
use serde::Deserialize;

use super::checks::{MOST_SAMPLES, count, level, needs_uncertain};
use super::{Place, TaskOptions, TaskSpec};
use crate::study::{Study, StudyError};

/// Settings of `task = "monte-carlo"`: sampling of the parameters of `[uncertain]`, and reported statistics.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct MonteCarloTask {
    /// Design to be examined: `optimum` (default: the study is solved first) or `start`.
    pub at: Place,
    /// Number of samples; default 1000.
    pub samples: usize,
    /// Sampling method: `random` (default), `latin-hypercube`, or `sobol` (a scrambled sequence).
    pub method: Sampling,
    /// Levels of the reported quantiles; default [0.05, 0.5, 0.95].
    pub quantiles: Vec<f64>,
    /// Confidence level of the intervals; default 0.95.
    pub level: f64,
}

impl Default for MonteCarloTask {
    fn default() -> Self {
        let quantiles = vec![0.05, 0.5, 0.95];
        Self { at: Place::Optimum, samples: 1000, method: Sampling::Random, quantiles, level: 0.95 }
    }
}

impl TaskOptions for MonteCarloTask {
    const NAME: &'static str = "monte-carlo";
    const ABOUT: &'static str = "Sample the uncertain parameters: distributions of the criteria.";

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

impl TaskSpec for MonteCarloTask {
    fn at(&self) -> Option<Place> {
        Some(self.at)
    }

    fn check(&self, study: &Study, is_performed: bool) -> Result<(), StudyError> {
        if is_performed {
            needs_uncertain(study)?;
        }
        self.check_numbers().map_err(|mistake| mistake.within(Self::TABLE))
    }
}

impl MonteCarloTask {
    fn check_numbers(&self) -> Result<(), StudyError> {
        count("samples", self.samples, 2, MOST_SAMPLES)?;
        if let Some(wrong) = self.quantiles.iter().find(|p| !(**p > 0.0 && **p < 1.0)) {
            return Err(StudyError::new(
                "quantiles",
                format!("expected quantile levels between 0 and 1, found {wrong}"),
            )
            .with_help("the 0.95 quantile is the value that 95 % of the samples do not exceed"));
        }
        level(self.level)
    }
}
