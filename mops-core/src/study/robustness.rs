//! What the tasks over uncertain parameters are asked, and what a calibration is asked of its uncertainty.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::tasks::Place;
use super::{Study, Task, Tasks};
use crate::diagnostic::suggestion;
use crate::evaluation::Objective;
use crate::mistake::Mistake;
use crate::statistics::Sampling;

/// More samples than this are refused: nobody waits for them by intention.
const MOST_SAMPLES: usize = 10_000_000;

/// What `task = "worst-case"` is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstCaseTask {
    /// The design that is looked at.
    pub at: Place,
    /// Names of the criteria whose worst is sought; all that count, or all where none counts, where absent.
    pub criteria: Option<Vec<String>>,
    /// Points at which every criterion is looked at first; the corners of the box come on top.
    pub samples: usize,
    /// Local searches for every criterion.
    pub starts: usize,
}

impl Default for WorstCaseTask {
    fn default() -> Self {
        Self { at: Place::Optimum, criteria: None, samples: 128, starts: 8 }
    }
}

/// What a design against the worst cases is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustTask {
    /// Rounds of designing and searching, at most.
    pub rounds: usize,
    /// What a worst case may exceed the design's own worst by, in scaled values, without being added.
    pub tolerance: f64,
    /// As in [`WorstCaseTask`].
    pub samples: usize,
    /// As in [`WorstCaseTask`].
    pub starts: usize,
}

impl Default for RobustTask {
    fn default() -> Self {
        Self { rounds: 12, tolerance: 1e-3, samples: 128, starts: 4 }
    }
}

/// What `task = "monte-carlo"` is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct MonteCarloTask {
    /// The design that is looked at.
    pub at: Place,
    /// Number of samples.
    pub samples: usize,
    /// How they are drawn.
    pub method: Sampling,
    /// Shares of the values whose bounds are told.
    pub quantiles: Vec<f64>,
    /// Confidence of the intervals.
    pub level: f64,
}

impl Default for MonteCarloTask {
    fn default() -> Self {
        let quantiles = vec![0.05, 0.5, 0.95];
        Self { at: Place::Optimum, samples: 1000, method: Sampling::Random, quantiles, level: 0.95 }
    }
}

/// How `task = "sensitivity"` looks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SensitivityMethod {
    /// Slopes along the tuners at a point.
    #[default]
    Local,
    /// Elementary effects of the uncertain parameters: which of them matter at all.
    Morris,
    /// Shares of the variance by the uncertain parameters.
    Sobol,
}

/// What a calibration is asked of the uncertainty of its estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct UncertaintyTask {
    /// Whether every estimate gets a profile of the likelihood; or those of these tuners alone.
    pub profile: Chosen,
    /// Number of bootstrap replicates; none where 0.
    pub bootstrap: usize,
    /// Length of a block of the bootstrap, in samples; the cube root of their number where absent.
    pub block: Option<usize>,
    /// Whether predictions get bands.
    pub bands: bool,
    /// Confidence of all intervals.
    pub level: f64,
}

/// None, some, or all.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Chosen {
    /// None.
    #[default]
    None,
    /// These.
    Some(Vec<String>),
    /// All.
    All,
}

impl Chosen {
    /// Whether it is chosen.
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

/// Checks what the tasks over uncertain parameters are asked; `tasks.uncertain` is checked already.
pub(super) fn check(tasks: &Tasks, study: &Study) -> Result<(), Mistake> {
    let global = study.task == Task::Sensitivity && tasks.sensitivity.method != SensitivityMethod::Local;
    // Other tasks of the same study leave the table aside.
    let robust = tasks.robust.is_some() && study.task == Task::Design;
    let worst = matches!(study.task, Task::WorstCase);
    if tasks.robust.is_some() && study.task == Task::Calibration {
        return Err(Mistake::new("robust", "only a design is made against worst cases, and this is a calibration")
            .with_help("remove [robust]; [uncertainty] tells how well the data determine the estimates"));
    }
    if robust && study.objective != Objective::Max {
        return Err(Mistake::new(
            "robust",
            "a design against worst cases lowers the largest scaled value, and this one adds or lists them",
        )
        .with_help("remove [robust], or the `objective`"));
    }
    if (worst || robust || global || study.task == Task::MonteCarlo) && tasks.uncertain.is_empty() {
        let (key, table) = if robust { ("robust", None) } else { ("task", Some("study")) };
        let mistake = Mistake::new(key, "nothing is uncertain: the study names no parameter that is not known exactly")
            .with_help("add [uncertain] with NAME = { min = ..., max = ... } for parameters of the model");
        return Err(table.map_or(mistake.clone(), |table| mistake.within(table)));
    }
    let morris = global && tasks.sensitivity.method == SensitivityMethod::Morris;
    for uncertain in &tasks.uncertain {
        let within = |m: Mistake| m.within("uncertain");
        if (worst || robust || morris) && !uncertain.is_bounded() {
            let fact = format!("a box needs both bounds, and `{}` has none on one side", uncertain.name);
            return Err(within(Mistake::new(&uncertain.name, fact).with_help("give it `min` and `max`")));
        }
        if robust && uncertain.tuner.is_some() {
            let fact =
                format!("`{}` is a tuner: a design cannot choose it and guard against it at once", uncertain.name);
            let help = "remove it from [uncertain]; task = \"worst-case\" tells how much its tolerance matters";
            return Err(within(Mistake::new(&uncertain.name, fact).with_help(help)));
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

fn count(key: &str, number: usize, least: usize, most: usize) -> Result<(), Mistake> {
    if (least..=most).contains(&number) {
        return Ok(());
    }
    Err(Mistake::new(key, format!("`{key}` takes {least} to {most}, not {number}"))
        .with_help("leave it out for its default"))
}

fn worst_case(task: &WorstCaseTask, study: &Study) -> Result<(), Mistake> {
    let known = || study.rows.iter().map(|row| row.name.as_str());
    if let Some(name) = task.criteria.iter().flatten().find(|name| !known().any(|known| known == **name)) {
        let mut names: Vec<&str> = known().collect();
        names.dedup();
        return Err(Mistake::new(name, format!("the study has no criterion `{name}`"))
            .with_help(suggestion(name, names.iter().copied()))
            .within("criteria"));
    }
    count("samples", task.samples, 1, MOST_SAMPLES)?;
    count("starts", task.starts, 1, 1000)
}

fn robust_design(task: &RobustTask) -> Result<(), Mistake> {
    count("rounds", task.rounds, 1, 1000)?;
    count("samples", task.samples, 1, MOST_SAMPLES)?;
    count("starts", task.starts, 1, 1000)?;
    if task.tolerance > 0.0 && task.tolerance < 1.0 {
        return Ok(());
    }
    let fact = format!("the tolerance counts in scaled values, between 0 and 1, and is not {}", task.tolerance);
    Err(Mistake::new("tolerance", fact).with_help("0.001, the default, is a thousandth of a demand"))
}

fn level(level: f64) -> Result<(), Mistake> {
    if (0.5..1.0).contains(&level) {
        return Ok(());
    }
    Err(Mistake::new("level", format!("the confidence of an interval lies between 0.5 and 1, not at {level}"))
        .with_help("0.95, the default, misses the truth once in twenty times"))
}

fn monte_carlo(task: &MonteCarloTask) -> Result<(), Mistake> {
    count("samples", task.samples, 2, MOST_SAMPLES)?;
    if let Some(wrong) = task.quantiles.iter().find(|p| !(**p > 0.0 && **p < 1.0)) {
        return Err(Mistake::new(
            "quantiles",
            format!("a quantile belongs to a share between 0 and 1, not to {wrong}"),
        )
        .with_help("0.95 is the value that 95 % of the samples do not exceed"));
    }
    level(task.level)
}

fn uncertainty(task: Option<&UncertaintyTask>, study: &Study) -> Result<(), Mistake> {
    let Some(task) = task else { return Ok(()) };
    if study.cases.iter().all(|case| case.experiment.is_none()) {
        return Err(Mistake::here("only a calibration has estimates whose uncertainty can be told")
            .with_help("remove [uncertainty]; what parameters are known to lie in stands in [uncertain]"));
    }
    if let Chosen::Some(names) = &task.profile {
        let known = || study.tuners.iter().filter(|t| t.active).map(|t| t.name.as_str());
        if let Some(name) = names.iter().find(|name| !known().any(|known| known == **name)) {
            let fact = format!("the study has no active tuner `{name}`");
            return Err(Mistake::new("profile", fact).with_help(suggestion(name, known())));
        }
    }
    if task.bootstrap > 0 {
        count("bootstrap", task.bootstrap, 20, 100_000)?;
    }
    if task.block == Some(0) {
        return Err(Mistake::new("block", "a block has at least one sample").with_help("leave it out for its default"));
    }
    level(task.level)
}
