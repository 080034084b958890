//! `task = "sensitivity"`: which tuners the criteria or the data determine; or effects of uncertain parameters.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::checks::{MOST_SAMPLES, count, needs_box, needs_uncertain};
use super::{Place, TaskOptions, TaskSpec};
use crate::study::{Study, StudyError};

/// Method of `task = "sensitivity"`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SensitivityMethod {
    /// Derivatives with respect to the tuners at a point.
    #[default]
    Local,
    /// Elementary effects of the uncertain parameters: screening of the relevant ones.
    Morris,
    /// Variance shares of the uncertain parameters (Sobol indices).
    Sobol,
}

/// Settings of `task = "sensitivity"`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct SensitivityTask {
    /// Point: `optimum` (default: the study is solved first) or `start`.
    pub at: Place,
    /// Smallest singular value that the derivatives resolve, as share of the largest (columns of unit length). Default
    /// 1e-8 for tangents and 1e-4 for finite differences. Resolved directions are compared with the noise.
    pub zero: Option<f64>,
    /// Method. `local` (default): derivatives with respect to the tuners. Over the box of `[uncertain]`: `morris`,
    /// elementary effects as an inexpensive screening; `sobol`, variance shares.
    pub method: SensitivityMethod,
    /// Number of trajectories for `morris` (default 20); each takes one simulation more than there are uncertain
    /// parameters. Number of samples for `sobol` (default 512); each takes two simulations more than there are
    /// uncertain parameters.
    pub samples: Option<usize>,
}

impl TaskOptions for SensitivityTask {
    const NAME: &'static str = "sensitivity";
    const ABOUT: &'static str =
        "Report which tuners, or which combinations of them, the criteria or the data determine.";

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

impl TaskSpec for SensitivityTask {
    fn at(&self) -> Option<Place> {
        Some(self.at)
    }

    fn check(&self, study: &Study, is_performed: bool) -> Result<(), StudyError> {
        if let Some(zero) = self.zero.filter(|zero| !(*zero > 0.0 && *zero < 1.0)) {
            return Err(StudyError::new(
                "zero",
                format!("expected a share of the largest singular value between 0 and 1, found {zero}"),
            )
            .with_help("omit `zero` to use the accuracy of the derivatives")
            .within(Self::TABLE));
        }
        if is_performed && self.method != SensitivityMethod::Local {
            needs_uncertain(study)?;
        }
        if is_performed && self.method == SensitivityMethod::Morris {
            needs_box(study)?;
        }
        match self.samples {
            Some(samples) => count("samples", samples, 4, MOST_SAMPLES).map_err(|mistake| mistake.within(Self::TABLE)),
            None => Ok(()),
        }
    }
}
