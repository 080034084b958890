//! The tables of tasks in a study file: `[excitation]`, `[sensitivity]`, `[sweep]`, `[diagnosis]`, `[pareto]`.

use schemars::JsonSchema;

use super::entries::{Entries, Short};
use super::robustness;
use super::tree::Node;
use super::{Diagnostic, read_seconds};
use crate::catalogue::Catalogue;
use crate::diagnostic::suggestion;
use crate::mistake::Mistake;
use crate::study::{
    AxisDraft, DiagnosisTask, ExcitationDraft, ParetoTask, Place, RegressionDraft, SensitivityMethod, SensitivityTask,
    SweepDraft, Task, TasksDraft,
};
use crate::unit::Quantity;

/// What is asked of the inputs by `task = "excitation"`, and in the report of every calibration.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ExcitationSection {
    /// The inputs that are looked at; all where absent.
    pub inputs: Option<Vec<String>>,
    /// Time between two samples; that of the recording where absent.
    pub sample_time: Option<Quantity>,
    /// Standard deviation of the noise on inputs, as in { u = 0.01 }; what is weaker does not count as excitation.
    #[serde(default)]
    pub noise: Entries<Quantity>,
    /// Number of parameters to be estimated; that of the active tuners where absent.
    pub parameters: Option<usize>,
    /// FIR and ARX models by least squares, by name: { fir = { input = "u", output = "y", b = 20 } }.
    #[serde(default)]
    pub regressions: Entries<RegressionSection>,
}

/// A model `y(t) + a1 y(t-1) + ... = b1 u(t-delay) + ...`, by least squares and recursively.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct RegressionSection {
    /// The experiment; the first with the output where absent.
    pub experiment: Option<String>,
    /// The input.
    pub input: String,
    /// The measured output.
    pub output: String,
    /// Number of past outputs; 0, the default, is a finite impulse response.
    #[serde(default)]
    pub a: usize,
    /// Number of past inputs.
    pub b: usize,
    /// Samples from an input to the first output that it moves; 1 where absent.
    pub delay: Option<usize>,
    /// Forgetting factor of the recursive estimate; 1, the default, forgets nothing.
    pub forgetting: Option<f64>,
}

/// Where `task = "sensitivity"` looks.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SensitivitySection {
    /// The point: `optimum` (the default: the study is solved first) or `start`.
    #[serde(default)]
    pub at: Place,
    /// Share of the largest singular value (columns of unit length) that slopes still resolve; where absent 1e-8 for tangents
    /// and 1e-4 for differences. What they resolve is judged against the noise.
    pub zero: Option<f64>,
    /// `local` (the default): slopes along the tuners. Over the box of [uncertain] instead: `morris`, elementary effects,
    /// which tell at little cost what matters at all; `sobol`, shares of the variance.
    #[serde(default)]
    pub method: SensitivityMethod,
    /// Of `morris` the number of trajectories (20 where absent), each of one simulation more than there are uncertain
    /// parameters; of `sobol` that of samples (512), each of two more.
    pub samples: Option<usize>,
}

/// What `task = "sweep"` draws: the objective over one tuner, or over two.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SweepSection {
    /// The tuner along x: its name, or a table with `tuner`, `min`, `max`, `points`.
    pub x: Short<AxisTable>,
    /// The tuner along y; without it the sweep is a line.
    pub y: Option<Short<AxisTable>>,
    /// Where the other tuners stand: `optimum` (the default: the study is solved first) or `start`.
    #[serde(default)]
    pub at: Place,
}

/// A swept tuner.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct AxisTable {
    /// Name of the tuner.
    pub tuner: String,
    /// Smallest value; that of the tuner where absent.
    pub min: Option<Quantity>,
    /// Largest value; that of the tuner where absent.
    pub max: Option<Quantity>,
    /// Number of values; 41 on a surface and 201 on a line where absent.
    pub points: Option<usize>,
}

impl From<String> for AxisTable {
    fn from(tuner: String) -> Self {
        Self { tuner, min: None, max: None, points: None }
    }
}

/// How `task = "diagnosis"`, and `mops diagnose`, search for what the model lacks.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct DiagnosisSection {
    /// Largest number of effects that are added; 3 where absent.
    pub max_effects: Option<usize>,
    /// Probability with which something counts as missing where nothing is; 0.01 where absent.
    pub level: Option<f64>,
    /// Kinds of effect that are tried; all of the catalogue (`mops list`) where absent.
    pub effects: Option<Vec<String>>,
    /// Kinds of effect that are not tried.
    #[serde(default)]
    pub without: Vec<String>,
}

/// What `task = "pareto"`, and `mops pareto`, look for.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ParetoSection {
    /// Number of points of the front, about; 30 where absent.
    pub points: Option<usize>,
}

/// Names of the tables, as they stand at the top of a study file.
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

/// What a reader should know of tables of other tasks than that of the study: they do nothing.
pub(super) fn unused(root: &Node<'_>, task: Task) -> Vec<String> {
    let word = serde_json::to_value(task).expect("a task is a word");
    let is_of = |table: &str| match table {
        "uncertain" => true,
        "robust" => task == Task::Design,
        "uncertainty" => task == Task::Calibration,
        own => word == own,
    };
    let unused = TABLES.iter().filter(|table| root.child(table).is_some() && !is_of(table));
    unused.map(|table| format!("[{table}] does nothing in a study with the task {word}")).collect()
}

/// Reads the tables of all tasks; what is absent has its defaults.
pub(super) fn read(root: &Node<'_>, catalogue: &Catalogue) -> Result<TasksDraft, Diagnostic> {
    let mut tasks = TasksDraft::default();
    if let Some(node) = root.child("excitation") {
        let section: ExcitationSection = node.read()?;
        let regression = |(name, r): (String, RegressionSection)| {
            let RegressionSection { experiment, input, output, a, b, delay, forgetting } = r;
            let (delay, forgetting) = (delay.unwrap_or(1), forgetting.unwrap_or(1.0));
            (name, RegressionDraft { experiment, input, output, a, b, delay, forgetting })
        };
        tasks.excitation = ExcitationDraft {
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
        let axis = |Short(axis): Short<AxisTable>| AxisDraft {
            tuner: axis.tuner,
            min: axis.min,
            max: axis.max,
            points: axis.points.unwrap_or(points),
        };
        tasks.sweep = Some(SweepDraft { x: axis(section.x), y: section.y.map(axis), at: section.at });
    }
    if let Some(node) = root.child("diagnosis") {
        let DiagnosisSection { max_effects, level, effects, without } = node.read()?;
        for (key, names) in [("effects", effects.as_deref().unwrap_or_default()), ("without", &without)] {
            check_effects(catalogue, names).map_err(|m| root.locate(&m.within(key).within("diagnosis")))?;
        }
        let usual = DiagnosisTask::default();
        let (max_effects, level) = (max_effects.unwrap_or(usual.max_effects), level.unwrap_or(usual.level));
        tasks.diagnosis = DiagnosisTask { max_effects, level, effects, without };
    }
    if let Some(node) = root.child("pareto") {
        let ParetoSection { points } = node.read()?;
        tasks.pareto = ParetoTask { points: points.unwrap_or(ParetoTask::default().points) };
    }
    robustness::read(root, &mut tasks)?;
    Ok(tasks)
}

/// Refuses names that are those of no effect.
fn check_effects(catalogue: &Catalogue, names: &[String]) -> Result<(), Mistake> {
    let known = || catalogue.effects.iter().map(|effect| effect.name());
    match names.iter().find(|name| !known().any(|effect| effect == **name)) {
        None => Ok(()),
        Some(name) => {
            Err(Mistake::new(name, format!("there is no effect `{name}`")).with_help(suggestion(name, known())))
        }
    }
}
