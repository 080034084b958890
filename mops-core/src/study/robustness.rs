//! Settings of the tasks over uncertain parameters and of the uncertainty of a calibration, and their checks.

use mops_language::suggestion;
use mops_statistics::Sampling;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::tasks::Place;
use super::{Study, Task, Tasks};
use crate::evaluation::Objective;
use crate::study::StudyError;

/// Maximum number of samples.
const MOST_SAMPLES: usize = 10_000_000;

/// Settings of `task = "worst-case"`.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstCaseTask {
    /// Design to be examined.
    pub at: Place,
    /// Criteria for the worst-case search. `None` for every criterion that counts, or for all criteria if none counts.
    pub criteria: Option<Vec<String>>,
    /// Number of initial sample points per criterion, in addition to the corners of the box.
    pub samples: usize,
    /// Number of local searches per criterion.
    pub starts: usize,
}

impl Default for WorstCaseTask {
    fn default() -> Self {
        Self { at: Place::Optimum, criteria: None, samples: 128, starts: 8 }
    }
}

/// Settings of a design against worst cases.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustTask {
    /// Maximum number of iterations of design and search.
    pub rounds: usize,
    /// Tolerance in scaled values: a worst case is added only if it exceeds the present worst scaled value by more.
    pub tolerance: f64,
    /// Number of initial sample points, as in [`WorstCaseTask`].
    pub samples: usize,
    /// Number of local searches, as in [`WorstCaseTask`].
    pub starts: usize,
}

impl Default for RobustTask {
    fn default() -> Self {
        Self { rounds: 12, tolerance: 1e-3, samples: 128, starts: 4 }
    }
}

/// Settings of `task = "monte-carlo"`.
#[derive(Debug, Clone, PartialEq)]
pub struct MonteCarloTask {
    /// Design to be examined.
    pub at: Place,
    /// Number of samples.
    pub samples: usize,
    /// Sampling method.
    pub method: Sampling,
    /// Levels of the reported quantiles.
    pub quantiles: Vec<f64>,
    /// Confidence level of the intervals.
    pub level: f64,
}

impl Default for MonteCarloTask {
    fn default() -> Self {
        let quantiles = vec![0.05, 0.5, 0.95];
        Self { at: Place::Optimum, samples: 1000, method: Sampling::Random, quantiles, level: 0.95 }
    }
}

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

/// Settings of the uncertainty of a calibration's estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct UncertaintyTask {
    /// Tuners for which a likelihood profile is computed.
    pub profile: Chosen,
    /// Number of bootstrap replicates; 0 for no bootstrap.
    pub bootstrap: usize,
    /// Block length of the bootstrap, in samples; `None` for the cube root of the number of samples.
    pub block: Option<usize>,
    /// True if confidence bands of predictions are computed.
    pub bands: bool,
    /// Confidence level of all intervals.
    pub level: f64,
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

impl Default for UncertaintyTask {
    fn default() -> Self {
        Self { profile: Chosen::None, bootstrap: 0, block: None, bands: false, level: 0.95 }
    }
}

/// Checks the settings of the tasks over uncertain parameters; `tasks.uncertain` is already checked.
pub(super) fn check(tasks: &Tasks, study: &Study) -> Result<(), StudyError> {
    let global = study.task == Task::Sensitivity && tasks.sensitivity.method != SensitivityMethod::Local;
    // Other tasks of the same study ignore the table.
    let robust = tasks.robust.is_some() && study.task == Task::Design;
    let worst = matches!(study.task, Task::WorstCase);
    if tasks.robust.is_some() && study.task == Task::Calibration {
        return Err(StudyError::new("robust", "[robust] applies to designs, but this study is a calibration")
            .with_help("remove [robust]; [uncertainty] reports how well the data determine the estimates"));
    }
    if robust && study.objective != Objective::Max {
        return Err(StudyError::new(
            "robust",
            "a design against worst cases minimises the largest scaled value: it needs objective = \"max\"",
        )
        .with_help("remove [robust] or `objective`"));
    }
    if (worst || robust || global || study.task == Task::MonteCarlo) && tasks.uncertain.is_empty() {
        let (key, table) = if robust { ("robust", None) } else { ("task", Some("study")) };
        let mistake = StudyError::new(key, "the study has no uncertain parameter")
            .with_help("add [uncertain] with NAME = { min = ..., max = ... } for parameters of the model");
        return Err(table.map_or(mistake.clone(), |table| mistake.within(table)));
    }
    let morris = global && tasks.sensitivity.method == SensitivityMethod::Morris;
    for uncertain in &tasks.uncertain {
        let within = |m: StudyError| m.within("uncertain");
        if (worst || robust || morris) && !uncertain.is_bounded() {
            let fact = format!("a box needs two finite bounds, but `{}` has a missing one", uncertain.name);
            return Err(within(StudyError::new(&uncertain.name, fact).with_help("set `min` and `max`")));
        }
        if robust && uncertain.tuner.is_some() && uncertain.tolerance.is_none() {
            let fact = format!(
                "`{}` is a tuner, so that a design against worst cases cannot have a fixed range of it",
                uncertain.name
            );
            let help = "give its deviation from the design value: tolerance = 0.05";
            return Err(within(StudyError::new(&uncertain.name, fact).with_help(help)));
        }
    }
    worst_case(&tasks.worst_case, study).map_err(|m| m.within("worst-case"))?;
    tasks.robust.as_ref().map_or(Ok(()), robust_design).map_err(|m| m.within("robust"))?;
    monte_carlo(&tasks.monte_carlo).map_err(|m| m.within("monte-carlo"))?;
    if let Some(samples) = tasks.sensitivity.samples {
        count("samples", samples, 4, MOST_SAMPLES).map_err(|m| m.within("sensitivity"))?;
    }
    uncertainty(tasks.uncertainty.as_ref(), study).map_err(|m| m.within("uncertainty"))
}

fn count(key: &str, number: usize, least: usize, most: usize) -> Result<(), StudyError> {
    if (least..=most).contains(&number) {
        return Ok(());
    }
    Err(StudyError::new(key, format!("expected `{key}` from {least} to {most}, found {number}"))
        .with_help("omit it for the default"))
}

fn worst_case(task: &WorstCaseTask, study: &Study) -> Result<(), StudyError> {
    let known = || study.rows.iter().map(|row| row.name.as_str());
    if let Some(name) = task.criteria.iter().flatten().find(|name| !known().any(|known| known == **name)) {
        let mut names: Vec<&str> = known().collect();
        names.dedup();
        return Err(StudyError::new(name, format!("the study has no criterion `{name}`"))
            .with_help(suggestion(name, names.iter().copied()))
            .within("criteria"));
    }
    count("samples", task.samples, 1, MOST_SAMPLES)?;
    count("starts", task.starts, 1, 1000)
}

fn robust_design(task: &RobustTask) -> Result<(), StudyError> {
    count("rounds", task.rounds, 1, 1000)?;
    count("samples", task.samples, 1, MOST_SAMPLES)?;
    count("starts", task.starts, 1, 1000)?;
    if task.tolerance > 0.0 && task.tolerance < 1.0 {
        return Ok(());
    }
    let fact = format!("expected a tolerance between 0 and 1 in scaled values, found {}", task.tolerance);
    Err(StudyError::new("tolerance", fact).with_help("the default 0.001 is a thousandth of a demand"))
}

fn level(level: f64) -> Result<(), StudyError> {
    if (0.5..1.0).contains(&level) {
        return Ok(());
    }
    Err(StudyError::new("level", format!("expected a confidence level from 0.5 to below 1, found {level}"))
        .with_help("with the default 0.95, one interval in twenty misses the true value"))
}

fn monte_carlo(task: &MonteCarloTask) -> Result<(), StudyError> {
    count("samples", task.samples, 2, MOST_SAMPLES)?;
    if let Some(wrong) = task.quantiles.iter().find(|p| !(**p > 0.0 && **p < 1.0)) {
        return Err(StudyError::new("quantiles", format!("expected quantile levels between 0 and 1, found {wrong}"))
            .with_help("the 0.95 quantile is the value that 95 % of the samples do not exceed"));
    }
    level(task.level)
}

fn uncertainty(task: Option<&UncertaintyTask>, study: &Study) -> Result<(), StudyError> {
    let Some(task) = task else { return Ok(()) };
    if study.cases.iter().all(|case| case.experiment.is_none()) {
        return Err(StudyError::here("[uncertainty] needs a calibration: the study has no experiment")
            .with_help("remove [uncertainty]; ranges of uncertain parameters belong in [uncertain]"));
    }
    if let Chosen::Some(names) = &task.profile {
        let known = || study.tuners.iter().filter(|t| t.active).map(|t| t.name.as_str());
        if let Some(name) = names.iter().find(|name| !known().any(|known| known == **name)) {
            let fact = format!("the study has no active tuner `{name}`");
            return Err(StudyError::new("profile", fact).with_help(suggestion(name, known())));
        }
    }
    if task.bootstrap > 0 {
        count("bootstrap", task.bootstrap, 20, 100_000)?;
    }
    if task.block == Some(0) {
        return Err(StudyError::new("block", "a block has at least one sample").with_help("omit it for the default"));
    }
    level(task.level)
}
