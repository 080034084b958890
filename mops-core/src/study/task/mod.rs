//! Tasks: what a study is solved or examined for, and the facts that the core needs of each.
//!
//! A task is performed, and its result is shown, above the core.

mod calibration;
mod design;
mod diagnosis;
mod excitation;
mod monte_carlo;
mod pareto;
mod sensitivity;
mod sweep;
mod worst_case;

use std::any::Any;
use std::fmt;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize, Serializer};

use crate::effect::Effect;
use crate::evaluation::Objective;
use crate::study::{Study, StudyError};

pub use calibration::{CalibrationTask, Chosen, UncertaintyTask};
pub use design::{DesignTask, RobustTask};
pub use diagnosis::DiagnosisTask;
pub use excitation::{ExcitationQuestion, ExcitationTask, Regression, RegressionOptions};
pub use monte_carlo::MonteCarloTask;
pub use pareto::ParetoTask;
pub use sensitivity::{SensitivityMethod, SensitivityTask};
pub use sweep::{Axis, AxisOptions, SweepTask};
pub use worst_case::WorstCaseTask;

/// Point at which a task is performed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// The optimum: the study is solved first.
    #[default]
    Optimum,
    /// The initial guess of the tuners; nothing is solved.
    Start,
}

/// Facts of a task with its options.
pub trait TaskSpec: Any + fmt::Debug + Send + Sync {
    /// Returns the point at which the task is performed, so that [`Place::Optimum`] needs a solver; `None` if it is
    /// performed at no point.
    fn at(&self) -> Option<Place>;

    /// Returns the objective of a search unless the study gives one; `is_measured`: the study has experiments. By
    /// default that of the study which a task examines: a calibration if there are experiments, else a design.
    fn objective(&self, is_measured: bool) -> Objective {
        if is_measured { Objective::Sum } else { Objective::Max }
    }

    /// Returns true if the task needs a criterion.
    fn needs_criteria(&self) -> bool {
        true
    }

    /// Returns true if the values of the tuners are the result, so that a criterion must count on data for calibration.
    fn chooses_tuners(&self) -> bool {
        false
    }

    /// Returns the signals to be simulated besides those that criteria read: model, case, signals.
    fn signals(&self, _study: &Study) -> Vec<(usize, usize, Vec<String>)> {
        Vec::new()
    }

    /// Returns a note for a study whose uncertain parameters the task ignores against expectation.
    fn ignores_uncertain(&self) -> Option<&'static str> {
        None
    }

    /// Checks the options. `is_performed`: the study performs this task; else it only has the options.
    ///
    /// # Errors
    /// The first error; it names the key, within the table of the task.
    fn check(&self, study: &Study, is_performed: bool) -> Result<(), StudyError>;

    /// Checks names of effects in the options; `effects` are those of the catalogue.
    ///
    /// # Errors
    /// The first unknown name.
    fn check_effects(&self, _effects: &[Arc<dyn Effect>]) -> Result<(), StudyError> {
        Ok(())
    }
}

/// Options of a kind of task, as written in its table of a study file; their documentation is the page of the table.
pub trait TaskOptions: TaskSpec + DeserializeOwned + JsonSchema {
    /// Word of the task in study files.
    const NAME: &'static str;

    /// Name of the table with the options.
    const TABLE: &'static str = Self::NAME;

    /// Purpose of the task, in a sentence.
    const ABOUT: &'static str;

    /// Example of the table, for a message that it is missing.
    const EXAMPLE: &'static str = "";

    /// Returns the options of a study without the table; `None` if the task needs it.
    fn absent() -> Option<Self>;
}

/// Task of a study, with its options.
#[derive(Debug, Clone)]
pub struct Task {
    name: &'static str,
    spec: Arc<dyn TaskSpec>,
}

impl<T: TaskOptions> From<T> for Task {
    fn from(task: T) -> Self {
        Self { name: T::NAME, spec: Arc::new(task) }
    }
}

impl Default for Task {
    fn default() -> Self {
        DesignTask::default().into()
    }
}

impl std::ops::Deref for Task {
    type Target = dyn TaskSpec;

    fn deref(&self) -> &Self::Target {
        &*self.spec
    }
}

impl Task {
    /// Returns the task that estimates the tuners from measurements.
    pub fn calibration() -> Self {
        CalibrationTask::default().into()
    }

    /// Returns the word of the task in study files.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Returns the options if they are those of the kind `T`.
    pub fn options<T: TaskSpec>(&self) -> Option<&T> {
        let any: &dyn Any = &*self.spec;
        any.downcast_ref()
    }

    /// Returns true if the task is of the kind `T`.
    pub fn is<T: TaskSpec>(&self) -> bool {
        self.options::<T>().is_some()
    }
}

impl Serialize for Task {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name)
    }
}

/// Largest number of samples.
const MOST_SAMPLES: usize = 10_000_000;

/// Checks a count.
fn count(key: &str, number: usize, least: usize, most: usize) -> Result<(), StudyError> {
    if (least..=most).contains(&number) {
        return Ok(());
    }
    Err(StudyError::new(key, format!("expected `{key}` from {least} to {most}, found {number}"))
        .with_help("omit it for the default"))
}

/// Checks a confidence level.
fn level(level: f64) -> Result<(), StudyError> {
    if (0.5..1.0).contains(&level) {
        return Ok(());
    }
    Err(StudyError::new("level", format!("expected a confidence level from 0.5 to below 1, found {level}"))
        .with_help("with the default 0.95, one interval in twenty misses the true value"))
}

/// Checks that the study has uncertain parameters, if it performs a task over them.
fn needs_uncertain(study: &Study) -> Result<(), StudyError> {
    if study.uncertain().is_empty() {
        return Err(no_uncertain("task").within("study"));
    }
    Ok(())
}

fn no_uncertain(key: &str) -> StudyError {
    StudyError::new(key, "the study has no uncertain parameter")
        .with_help("add [uncertain] with NAME = { min = ..., max = ... } for parameters of the model")
}

/// Checks that all uncertain parameters are bounded.
fn needs_box(study: &Study) -> Result<(), StudyError> {
    let Some(uncertain) = study.uncertain().iter().find(|uncertain| !uncertain.is_bounded()) else { return Ok(()) };
    let fact = format!("a box needs two finite bounds, but `{}` has a missing one", uncertain.name);
    Err(StudyError::new(&uncertain.name, fact).with_help("set `min` and `max`").within("uncertain"))
}
