//! The tables of tasks in a study file: `[excitation]`, `[sensitivity]`, `[sweep]`, `[diagnosis]`, `[pareto]`.

use mops_core::{
    catalogue::Catalogue,
    study::{
        AxisBuilder, DiagnosisTask, ExcitationBuilder, ParetoTask, Place, RegressionBuilder, SensitivityMethod,
        SensitivityTask, StudyError, SweepBuilder, Task, TasksBuilder,
    },
};
use mops_language::{Quantity, suggestion};
use schemars::JsonSchema;

use super::entries::{Entries, Short};
use super::tree::Node;
use super::{Diagnostic, read_seconds, robustness};

/// Settings of the excitation analysis, for `task = "excitation"` and the report of every calibration.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ExcitationSection {
    /// Inputs to analyse; default all.
    pub inputs: Option<Vec<String>>,
    /// Sample time; default is the sample time of the recording.
    pub sample_time: Option<Quantity>,
    /// Standard deviation of the noise of each input, such as { u = 0.01 }; weaker components do not count as excitation.
    #[serde(default)]
    pub noise: Entries<Quantity>,
    /// Number of parameters to estimate; default is the number of active tuners.
    pub parameters: Option<usize>,
    /// FIR and ARX models estimated by least squares, by name: { fir = { input = "u", output = "y", b = 20 } }.
    #[serde(default)]
    pub regressions: Entries<RegressionSection>,
}

/// A model `y(t) + a1 y(t-1) + ... = b1 u(t-delay) + ...`, by least squares and recursively.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct RegressionSection {
    /// Experiment; default is the first one with the output.
    pub experiment: Option<String>,
    /// Input of the model.
    pub input: String,
    /// Measured output of the model.
    pub output: String,
    /// Number of past outputs; default 0, a finite impulse response.
    #[serde(default)]
    pub a: usize,
    /// Number of past inputs.
    pub b: usize,
    /// Delay in samples from an input to the first output that it affects; default 1.
    pub delay: Option<usize>,
    /// Forgetting factor of the recursive estimate; default 1, no forgetting.
    pub forgetting: Option<f64>,
}

/// Settings of `task = "sensitivity"`.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SensitivitySection {
    /// Point: `optimum` (default: the study is solved first) or `start`.
    #[serde(default)]
    pub at: Place,
    /// Smallest singular value that the derivatives resolve, as share of the largest (columns of unit length). Default 1e-8
    /// for tangents and 1e-4 for finite differences. Resolved directions are compared with the noise.
    pub zero: Option<f64>,
    /// Method. `local` (default): derivatives with respect to the tuners. Over the box of [uncertain]: `morris`, elementary
    /// effects as an inexpensive screening; `sobol`, variance shares.
    #[serde(default)]
    pub method: SensitivityMethod,
    /// Number of trajectories for `morris` (default 20); each takes one simulation more than there are uncertain parameters.
    /// Number of samples for `sobol` (default 512); each takes two simulations more than there are uncertain parameters.
    pub samples: Option<usize>,
}

/// Settings of `task = "sweep"`: the objective over one tuner, or over two.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SweepSection {
    /// Tuner along x: its name, or a table with `tuner`, `min`, `max`, `points`.
    pub x: Short<AxisTable>,
    /// Tuner along y; without it the sweep is a line.
    pub y: Option<Short<AxisTable>>,
    /// Values of the other tuners: `optimum` (default: the study is solved first) or `start`.
    #[serde(default)]
    pub at: Place,
}

/// A swept tuner.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct AxisTable {
    /// Name of the tuner.
    pub tuner: String,
    /// Smallest value; default is the lower bound of the tuner.
    pub min: Option<Quantity>,
    /// Largest value; default is the upper bound of the tuner.
    pub max: Option<Quantity>,
    /// Number of values; default 41 on a surface and 201 on a line.
    pub points: Option<usize>,
}

impl From<String> for AxisTable {
    fn from(tuner: String) -> Self {
        Self { tuner, min: None, max: None, points: None }
    }
}

/// Settings of the search for missing effects, for `task = "diagnosis"` and `mops diagnose`.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct DiagnosisSection {
    /// Maximum number of added effects; default 3.
    pub max_effects: Option<usize>,
    /// Significance level of the test for a lack of fit; default 0.05.
    pub level: Option<f64>,
    /// Kinds of effect to try; default is the whole catalogue (`mops list`).
    pub effects: Option<Vec<String>>,
    /// Kinds of effect to exclude.
    #[serde(default)]
    pub without: Vec<String>,
    /// Effects that the model has in any case, `effect@place` each, such as `coulomb-friction@joint:phi`: the search adds others.
    #[serde(default)]
    pub with: Vec<String>,
}

/// Settings of `task = "pareto"` and `mops pareto`.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ParetoSection {
    /// Number of points of the Pareto front; default 30.
    pub points: Option<usize>,
    /// True: every criterion is an objective in every case. False (default): a criterion is one objective, with the value of its
    /// worst case, which has the largest weighted scaled value.
    #[serde(default)]
    pub per_case: bool,
}

/// Names of the tables of tasks in a study file.
pub(super) const TABLES: [&str; 10] = [
    "excitation",
    "sensitivity",
    "sweep",
    "diagnosis",
    "pareto",
    "uncertain",
    "worst-case",
    "robust",
    "monte-carlo",
    "uncertainty",
];

/// Returns notes on tables of other tasks, which are not used.
pub(super) fn unused(root: &Node<'_>, task: Task) -> Vec<String> {
    let word = serde_json::to_value(task).expect("a task is a word");
    let is_of = |table: &str| match table {
        "uncertain" => true,
        "robust" => task == Task::Design,
        "uncertainty" => task == Task::Calibration,
        own => word == own,
    };
    let unused = TABLES.iter().filter(|table| root.child(table).is_some() && !is_of(table));
    unused.map(|table| format!("[{table}] is not used by the task {word}")).collect()
}

/// Reads the tables of all tasks into `tasks`; absent tables leave it as it is.
pub(super) fn read(root: &Node<'_>, catalogue: &Catalogue, tasks: &mut TasksBuilder) -> Result<(), Diagnostic> {
    if let Some(node) = root.child("excitation") {
        let section: ExcitationSection = node.read()?;
        let regression = |(name, r): (String, RegressionSection)| {
            let RegressionSection { experiment, input, output, a, b, delay, forgetting } = r;
            let (delay, forgetting) = (delay.unwrap_or(1), forgetting.unwrap_or(1.0));
            (name, RegressionBuilder { experiment, input, output, a, b, delay, forgetting })
        };
        tasks.excitation = ExcitationBuilder {
            sample_time: read_seconds(&node, "sample-time", section.sample_time.as_ref())?,
            inputs: section.inputs,
            noise: section.noise.0,
            parameters: section.parameters,
            regressions: section.regressions.0.into_iter().map(regression).collect(),
        };
    }
    if let Some(node) = root.child("sensitivity") {
        let section: SensitivitySection = node.read()?;
        let SensitivitySection { at, zero, method, samples } = section;
        tasks.sensitivity = SensitivityTask { at, zero, method, samples };
    }
    if let Some(node) = root.child("sweep") {
        let section: SweepSection = node.read()?;
        let points = if section.y.is_some() { 41 } else { 201 };
        let axis = |Short(axis): Short<AxisTable>| AxisBuilder {
            tuner: axis.tuner,
            min: axis.min,
            max: axis.max,
            points: axis.points.unwrap_or(points),
        };
        tasks.sweep = Some(SweepBuilder { x: axis(section.x), y: section.y.map(axis), at: section.at });
    }
    if let Some(node) = root.child("diagnosis") {
        let DiagnosisSection { max_effects, level, effects, without, with } = node.read()?;
        for (key, names) in [("effects", effects.as_deref().unwrap_or_default()), ("without", &without)] {
            check_effects(catalogue, names).map_err(|m| root.locate(&m.within(key).within("diagnosis")))?;
        }
        let usual = DiagnosisTask::default();
        let (max_effects, level) = (max_effects.unwrap_or(usual.max_effects), level.unwrap_or(usual.level));
        tasks.diagnosis = DiagnosisTask { max_effects, level, effects, without, with };
    }
    if let Some(node) = root.child("pareto") {
        let ParetoSection { points, per_case } = node.read()?;
        tasks.pareto = ParetoTask { points: points.unwrap_or(ParetoTask::default().points), per_case };
    }
    robustness::read(root, tasks)
}

/// Rejects names that are not effects of the catalogue.
fn check_effects(catalogue: &Catalogue, names: &[String]) -> Result<(), StudyError> {
    let known = || catalogue.effects.iter().map(|effect| effect.name());
    match names.iter().find(|name| !known().any(|effect| effect == **name)) {
        None => Ok(()),
        Some(name) => {
            Err(StudyError::new(name, format!("there is no effect `{name}`")).with_help(suggestion(name, known())))
        }
    }
}
