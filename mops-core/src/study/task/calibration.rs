//! `task = "calibration"`: the tuners that fit measurements; `[uncertainty]`: how well the data determine them.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer};

use mops_language::suggestion;

use super::checks::{count, level};
use super::{Place, Task, TaskOptions, TaskSpec};
use crate::evaluation::Objective;
use crate::study::{Study, StudyError};

use super::DesignTask;

/// Calibration, with the options of the uncertainty of its estimates.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(from = "UncertaintyTask")]
#[schemars(with = "UncertaintyTask")]
pub struct CalibrationTask {
    /// Options of the uncertainty of the estimates, if more than standard errors are requested.
    pub uncertainty: Option<UncertaintyTask>,
}

impl From<UncertaintyTask> for CalibrationTask {
    fn from(uncertainty: UncertaintyTask) -> Self {
        Self { uncertainty: Some(uncertainty) }
    }
}

/// Settings of the uncertainty of a calibration's estimates, in addition to standard errors.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct UncertaintyTask {
    /// Likelihood profiles: `true` for every tuner, or a list of tuners.
    pub profile: Chosen,
    /// Number of bootstrap replicates, with residuals resampled in blocks; default none. 200 are sufficient for
    /// standard errors, 1000 for intervals.
    pub bootstrap: usize,
    /// Block length in samples; default is the cube root of the number of samples, rounded up.
    pub block: Option<usize>,
    /// `true` computes confidence bands of the predictions of the calibrated model.
    pub bands: bool,
    /// Confidence level of all intervals; default 0.95.
    pub level: f64,
}

impl Default for UncertaintyTask {
    fn default() -> Self {
        Self { profile: Chosen::None, bootstrap: 0, block: None, bands: false, level: 0.95 }
    }
}

/// Selection of names: none, some or all.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Chosen {
    /// No name.
    #[default]
    None,
    /// Listed names.
    Some(Vec<String>),
    /// All names.
    All,
}

impl Chosen {
    /// Returns true if a name is selected.
    pub fn has(&self, name: &str) -> bool {
        match self {
            Self::None => false,
            Self::Some(names) => names.iter().any(|chosen| chosen == name),
            Self::All => true,
        }
    }
}

/// All or none, or listed names.
#[derive(Deserialize)]
#[serde(untagged)]
enum AllOrSome {
    All(bool),
    Some(Vec<String>),
}

impl<'de> Deserialize<'de> for Chosen {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match AllOrSome::deserialize(deserializer)? {
            AllOrSome::All(false) => Self::None,
            AllOrSome::All(true) => Self::All,
            AllOrSome::Some(names) => Self::Some(names),
        })
    }
}

impl JsonSchema for Chosen {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "AllOrSome".into()
    }
    fn inline_schema() -> bool {
        true
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [{ "type": "boolean" }, { "type": "array", "items": { "type": "string" } }] })
    }
}

impl TaskOptions for CalibrationTask {
    const NAME: &'static str = "calibration";
    const TABLE: &'static str = "uncertainty";
    const ABOUT: &'static str = "Estimate the tuners from measurements.";

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

impl TaskSpec for CalibrationTask {
    fn at(&self) -> Option<Place> {
        Some(Place::Optimum)
    }

    fn objective(&self, _is_measured: bool) -> Objective {
        Objective::Sum
    }

    fn chooses_tuners(&self) -> bool {
        true
    }

    fn ignores_uncertain(&self) -> Option<&'static str> {
        Some("this task ignores [uncertain]")
    }

    fn check(&self, study: &Study, is_performed: bool) -> Result<(), StudyError> {
        if is_performed && study.options::<DesignTask>().is_some_and(|design| design.robust.is_some()) {
            return Err(StudyError::new("robust", "[robust] applies to designs, but this study is a calibration")
                .with_help("remove [robust]; [uncertainty] reports how well the data determine the estimates"));
        }
        let Some(uncertainty) = &self.uncertainty else { return Ok(()) };
        uncertainty.check(study).map_err(|mistake| mistake.within("uncertainty"))
    }
}

impl UncertaintyTask {
    fn check(&self, study: &Study) -> Result<(), StudyError> {
        if study.cases().iter().all(|case| case.experiment.is_none()) {
            return Err(StudyError::here("[uncertainty] needs a calibration: the study has no experiment")
                .with_help("remove [uncertainty]; ranges of uncertain parameters belong in [uncertain]"));
        }
        if let Chosen::Some(names) = &self.profile {
            let known = || study.tuners().iter().filter(|t| t.active).map(|t| t.name.as_str());
            if let Some(name) = names.iter().find(|name| !known().any(|known| known == **name)) {
                let fact = format!("the study has no active tuner `{name}`");
                return Err(StudyError::new("profile", fact).with_help(suggestion(name, known())));
            }
        }
        if self.bootstrap > 0 {
            count("bootstrap", self.bootstrap, 20, 100_000)?;
        }
        if self.block == Some(0) {
            return Err(
                StudyError::new("block", "a block has at least one sample").with_help("omit it for the default")
            );
        }
        level(self.level)
    }
}

impl Task {
    /// Returns the task that estimates the tuners from measurements.
    pub fn calibration() -> Self {
        CalibrationTask::default().into()
    }
}
