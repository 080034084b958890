//! Settings of the tasks other than design and calibration, and their checks.

use mops_language::{Quantity, suggestion};

use super::diagnosis::{self, DiagnosisTask};
use super::distribution::Uncertain;
use super::robustness::{self, MonteCarloTask, RobustTask, SensitivityMethod, UncertaintyTask, WorstCaseTask};
use super::uncertain::{self, UncertainBuilder};
use super::{Row, Study, Task};
use crate::case::Role;
use crate::criterion::Usage;
use crate::evaluation::Objective;
use crate::study::{Grid, StudyError};

/// Point at which a task is performed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// The optimum: the study is solved first.
    #[default]
    Optimum,
    /// The initial guess of the tuners; nothing is solved.
    Start,
}

/// Settings of the tasks of a study, not yet checked.
#[derive(Debug, Clone, Default)]
pub struct TasksBuilder {
    /// Settings of `excitation`.
    pub excitation: ExcitationBuilder,
    /// Settings of `sensitivity`.
    pub sensitivity: SensitivityTask,
    /// Settings of `sweep`, if given.
    pub sweep: Option<SweepBuilder>,
    /// Settings of `diagnosis`.
    pub diagnosis: DiagnosisTask,
    /// Settings of `pareto`.
    pub pareto: ParetoTask,
    /// Uncertain parameters, by name.
    pub uncertain: Vec<(String, UncertainBuilder)>,
    /// Settings of `worst-case`.
    pub worst_case: WorstCaseTask,
    /// Settings of a design against worst cases, if given.
    pub robust: Option<RobustTask>,
    /// Settings of `monte-carlo`.
    pub monte_carlo: MonteCarloTask,
    /// Settings of the uncertainty of a calibration's estimates, if more than standard errors are requested.
    pub uncertainty: Option<UncertaintyTask>,
}

/// Settings of the tasks of a study.
#[derive(Debug, Clone, Default)]
pub struct Tasks {
    /// Settings of `excitation`.
    pub excitation: ExcitationTask,
    /// Settings of `sensitivity`.
    pub sensitivity: SensitivityTask,
    /// Settings of `sweep`, if given.
    pub sweep: Option<SweepTask>,
    /// Settings of `diagnosis`.
    pub diagnosis: DiagnosisTask,
    /// Settings of `pareto`.
    pub pareto: ParetoTask,
    /// Uncertain parameters.
    pub uncertain: Vec<Uncertain>,
    /// Settings of `worst-case`.
    pub worst_case: WorstCaseTask,
    /// Settings of a design against worst cases, if given.
    pub robust: Option<RobustTask>,
    /// Settings of `monte-carlo`.
    pub monte_carlo: MonteCarloTask,
    /// Settings of the uncertainty of a calibration's estimates, if more than standard errors are requested.
    pub uncertainty: Option<UncertaintyTask>,
}

/// Settings of `excitation`, not yet checked.
#[derive(Debug, Clone, Default)]
pub struct ExcitationBuilder {
    /// Inputs; `None` for all.
    pub inputs: Option<Vec<String>>,
    /// Sample time, s.
    pub sample_time: Option<f64>,
    /// Standard deviation of the noise of each input.
    pub noise: Vec<(String, Quantity)>,
    /// Number of parameters to estimate.
    pub parameters: Option<usize>,
    /// FIR and ARX models, by name.
    pub regressions: Vec<(String, RegressionBuilder)>,
}

/// Settings of the excitation analysis of inputs.
#[derive(Debug, Clone, Default)]
pub struct ExcitationQuestion {
    /// Inputs; `None` for all.
    pub inputs: Option<Vec<String>>,
    /// Sample time, s; `None` for the sample time of the recording.
    pub sample_time: Option<f64>,
    /// Standard deviation of the noise of each input, in the units of the models.
    pub noise: Vec<(String, f64)>,
    /// Number of parameters to estimate; `None` for the number of tuners that act in the case.
    pub parameters: Option<usize>,
}

/// Settings of `excitation`.
#[derive(Debug, Clone, Default)]
pub struct ExcitationTask {
    /// Settings of the excitation analysis of inputs.
    pub question: ExcitationQuestion,
    /// FIR and ARX models.
    pub regressions: Vec<RegressionTask>,
}

/// A FIR or ARX model, not yet checked.
#[derive(Debug, Clone)]
pub struct RegressionBuilder {
    /// Name of the experiment; `None` for the first one with the output.
    pub experiment: Option<String>,
    /// Input of the model.
    pub input: String,
    /// Measured output of the model.
    pub output: String,
    /// Number of past outputs.
    pub a: usize,
    /// Number of past inputs.
    pub b: usize,
    /// Delay from input to output, in samples.
    pub delay: usize,
    /// Forgetting factor of the recursive estimate.
    pub forgetting: f64,
}

/// A FIR or ARX model of an experiment.
#[derive(Debug, Clone)]
pub struct RegressionTask {
    /// Name.
    pub name: String,
    /// Experiment, as index into the cases.
    pub case: usize,
    /// Input of the model.
    pub input: String,
    /// Measured output of the model.
    pub output: String,
    /// Number of past outputs.
    pub a: usize,
    /// Number of past inputs.
    pub b: usize,
    /// Delay from input to output, in samples.
    pub delay: usize,
    /// Forgetting factor of the recursive estimate.
    pub forgetting: f64,
}

/// Settings of `sensitivity`.
#[derive(Debug, Clone, Copy, Default)]
pub struct SensitivityTask {
    /// Point at which the sensitivities are computed.
    pub at: Place,
    /// Share of the largest singular value below which a singular value counts as zero; `None` for the accuracy of the
    /// derivatives.
    pub zero: Option<f64>,
    /// Derivatives at the point, or effects of the uncertain parameters over their ranges.
    pub method: SensitivityMethod,
    /// Number of trajectories (`morris`) or of samples (`sobol`); `None` for the default.
    pub samples: Option<usize>,
}

/// Settings of `sweep`, not yet checked.
#[derive(Debug, Clone)]
pub struct SweepBuilder {
    /// Tuner along x.
    pub x: AxisBuilder,
    /// Tuner along y; without it the sweep is a line.
    pub y: Option<AxisBuilder>,
    /// Values of the other tuners.
    pub at: Place,
}

/// A swept tuner, not yet checked.
#[derive(Debug, Clone)]
pub struct AxisBuilder {
    /// Name.
    pub tuner: String,
    /// Smallest value; `None` for the lower bound of the tuner.
    pub min: Option<Quantity>,
    /// Largest value; `None` for the upper bound of the tuner.
    pub max: Option<Quantity>,
    /// Number of values.
    pub points: usize,
}

/// Settings of `sweep`.
#[derive(Debug, Clone)]
pub struct SweepTask {
    /// Tuner along x.
    pub x: Axis,
    /// Tuner along y.
    pub y: Option<Axis>,
    /// Values of the other tuners.
    pub at: Place,
}

/// A swept tuner.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Tuner, as index into [`Study::tuners`].
    pub tuner: usize,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Number of values.
    pub points: usize,
}

/// Settings of `pareto`.
#[derive(Debug, Clone, Copy)]
pub struct ParetoTask {
    /// Number of points of the Pareto front.
    pub points: usize,
    /// True if a criterion counts as an objective in every case, false if it counts in its worst case.
    pub per_case: bool,
}

impl Default for ParetoTask {
    fn default() -> Self {
        Self { points: 30, per_case: false }
    }
}

/// Maximum number of points of a Pareto front.
const MOST_OF_FRONT: usize = 200;

/// Maximum number of values along an axis.
const MOST_POINTS: usize = 1000;

pub(super) fn build(draft: TasksBuilder, study: &Study) -> Result<Tasks, StudyError> {
    let excitation = excitation(draft.excitation, study).map_err(|m| m.within("excitation"))?;
    if let Some(zero) = draft.sensitivity.zero
        && !(zero > 0.0 && zero < 1.0)
    {
        return Err(StudyError::new(
            "zero",
            format!("expected a share of the largest singular value between 0 and 1, found {zero}"),
        )
        .with_help("omit `zero` to use the accuracy of the derivatives")
        .within("sensitivity"));
    }
    let sweep = draft.sweep.map(|sweep| self::sweep(sweep, study)).transpose().map_err(|m| m.within("sweep"))?;
    if study.task == Task::Sweep && sweep.is_none() {
        return Err(StudyError::new("task", "the study has no table [sweep]")
            .with_help("add [sweep] with x = \"tuner\" and, for a surface, y = \"tuner\"")
            .within("study"));
    }
    if study.task == Task::Excitation && study.cases.iter().all(|case| case.inputs.is_empty()) {
        return Err(StudyError::new("task", "no case and no experiment has an input signal")
            .with_help("add `inputs` to a case, such as inputs = { u = { step = { after = 1.0 } } }")
            .within("study"));
    }
    let diagnosis = diagnosis::check(draft.diagnosis, study)?;
    let pareto = pareto(draft.pareto, study)?;
    let tasks = Tasks {
        excitation,
        sensitivity: draft.sensitivity,
        sweep,
        diagnosis,
        uncertain: uncertain::check(draft.uncertain, study)?,
        worst_case: draft.worst_case,
        robust: draft.robust,
        monte_carlo: draft.monte_carlo,
        uncertainty: draft.uncertainty,
        pareto,
    };
    robustness::check(&tasks, study)?;
    Ok(tasks)
}

fn pareto(task: ParetoTask, study: &Study) -> Result<ParetoTask, StudyError> {
    if !(3..=MOST_OF_FRONT).contains(&task.points) {
        let fact = format!("expected 3 to {MOST_OF_FRONT} points of the front, found {}", task.points);
        return Err(StudyError::new("points", fact).with_help("the default 30 gives a smooth curve").within("pareto"));
    }
    if study.task != Task::Pareto {
        return Ok(task);
    }
    if study.objective != Objective::Each {
        return Err(StudyError::new("objective", "a Pareto front needs objective = \"each\"")
            .with_help("remove `objective`, or set objective = \"each\"")
            .within("study"));
    }
    let counts = |row: &&Row| row.usage == Usage::Minimise && study.case_of(row).role() == Role::Calibration;
    let minimised: Vec<&Row> = study.rows.iter().filter(counts).collect();
    let is_single = |first: &&&Row| minimised.iter().all(|row| row.name == first.name);
    let single = minimised.first().filter(is_single);
    if let Some(row) = single.filter(|_| !task.per_case && minimised.len() > 1) {
        let fact = format!("a Pareto front needs at least two criteria to minimise, found only `{}`", row.name);
        return Err(StudyError::new("task", fact)
            .with_help(
                "omit `usage` of another criterion, or set per-case = true in [pareto] for the front over the cases",
            )
            .within("study"));
    }
    if minimised.len() < 2 {
        let known = minimised.first().map_or_else(|| "none".to_owned(), |row| format!("only `{}`", row.name));
        return Err(StudyError::new(
            "task",
            format!("a Pareto front needs at least two criteria to minimise, found {known}"),
        )
        .with_help("omit `usage` of another criterion, or set usage = \"minimise\"")
        .within("study"));
    }
    Ok(task)
}

fn excitation(draft: ExcitationBuilder, study: &Study) -> Result<ExcitationTask, StudyError> {
    let known: Vec<&str> =
        study.cases.iter().flat_map(|case| case.inputs.iter().map(|(name, _)| name.as_str())).collect();
    let check = |name: &str| -> Result<(), StudyError> {
        if known.contains(&name) {
            return Ok(());
        }
        Err(StudyError::new(name, format!("no case and no experiment has an input `{name}`"))
            .with_help(suggestion(name, known.iter().copied())))
    };
    for name in draft.inputs.iter().flatten() {
        check(name).map_err(|m| m.within("inputs"))?;
    }
    if let Some(time) = draft.sample_time.filter(|time| !(time.is_finite() && *time > 0.0)) {
        return Err(StudyError::new("sample-time", format!("the time between samples must be positive, not {time} s"))
            .with_help("omit it to use the sample time of the recording"));
    }
    let mut noise = Vec::new();
    for (name, quantity) in draft.noise {
        let within = |m: StudyError| m.within("noise");
        check(&name).map_err(within)?;
        let variables = study.models.iter().flat_map(|(_, m)| &m.interface().inputs);
        let unit = &variables.into_iter().find(|v| v.name == name).expect("inputs of cases are those of models").unit;
        let value = quantity.to(unit).map_err(|why| {
            within(StudyError::new(&name, why).with_help(format!("a number without a unit is in `{unit}`")))
        })?;
        if !(value.is_finite() && value > 0.0) {
            return Err(within(
                StudyError::new(&name, format!("a standard deviation must be positive, not {value}"))
                    .with_help("omit it if the noise is unknown"),
            ));
        }
        noise.push((name, value));
    }
    let mut regressions = Vec::new();
    for (name, draft) in draft.regressions {
        regressions.push(regression(name.clone(), draft, study).map_err(|m| m.within(&name).within("regressions"))?);
    }
    let question = ExcitationQuestion {
        inputs: draft.inputs,
        sample_time: draft.sample_time,
        noise,
        parameters: draft.parameters,
    };
    Ok(ExcitationTask { question, regressions })
}

fn regression(name: String, draft: RegressionBuilder, study: &Study) -> Result<RegressionTask, StudyError> {
    let RegressionBuilder { experiment, input, output, a, b, delay, forgetting } = draft;
    let measures = |i: &usize| study.cases[*i].experiment.as_ref().is_some_and(|e| e.channel(&output).is_some());
    let case = match &experiment {
        Some(wanted) => {
            let measured = || study.cases.iter().filter(|c| c.experiment.is_some()).map(|c| c.name.as_str());
            let found =
                study.cases.iter().position(|c| c.name == *wanted && c.experiment.is_some()).ok_or_else(|| {
                    StudyError::new("experiment", format!("the study has no experiment `{wanted}`"))
                        .with_help(suggestion(wanted, measured().collect::<Vec<_>>()))
                })?;
            let channels = study.cases[found].experiment.iter().flat_map(|e| &e.channels).map(|c| c.signal.as_str());
            if !measures(&found) {
                return Err(StudyError::new(
                    "output",
                    format!("the experiment `{wanted}` does not measure `{output}`"),
                )
                .with_help(suggestion(&output, channels.collect::<Vec<_>>())));
            }
            found
        }
        None => (0..study.cases.len()).find(measures).ok_or_else(|| {
            StudyError::new("output", format!("no experiment measures `{output}`"))
                .with_help("add it to the `channels` of an experiment")
        })?,
    };
    let inputs = &study.cases[case].inputs;
    if !inputs.iter().any(|(known, _)| *known == input) {
        return Err(StudyError::new(
            "input",
            format!("the experiment `{}` has no input `{input}`", study.cases[case].name),
        )
        .with_help(match inputs.is_empty() {
            true => "the experiment has no inputs: add `inputs`".to_owned(),
            false => suggestion(&input, inputs.iter().map(|(known, _)| known.as_str())),
        }));
    }
    if b == 0 {
        return Err(StudyError::new("b", "expected at least 1 coefficient of the input, found 0")
            .with_help("`b` is the number of coefficients of the input"));
    }
    if a + b > 200 {
        return Err(StudyError::new("b", format!("expected at most 200 coefficients, found {}", a + b))
            .with_help("use a longer sample time, or an ARX model: past outputs (`a`) shorten the response"));
    }
    if !(forgetting > 0.0 && forgetting <= 1.0) {
        return Err(StudyError::new(
            "forgetting",
            format!("expected a forgetting factor above 0 and at most 1, found {forgetting}"),
        )
        .with_help("1 disables forgetting; 0.98 forgets within about fifty samples"));
    }
    Ok(RegressionTask { name, case, input, output, a, b, delay, forgetting })
}

fn sweep(draft: SweepBuilder, study: &Study) -> Result<SweepTask, StudyError> {
    let x = axis(draft.x, study).map_err(|m| m.within("x"))?;
    let y = draft.y.map(|y| axis(y, study)).transpose().map_err(|m| m.within("y"))?;
    if y.as_ref().is_some_and(|y| y.tuner == x.tuner) {
        return Err(StudyError::new("y", format!("x and y are the same tuner `{}`", study.tuners[x.tuner].name))
            .with_help("name another tuner, or omit `y` for a line"));
    }
    Ok(SweepTask { x, y, at: draft.at })
}

fn axis(draft: AxisBuilder, study: &Study) -> Result<Axis, StudyError> {
    let name = &draft.tuner;
    let within = |m: StudyError| m.within("tuner");
    let index = study.tuners.iter().position(|t| t.name == *name).ok_or_else(|| {
        within(StudyError::here(format!("the study has no tuner `{name}`")))
            .with_help(suggestion(name, study.tuners.iter().map(|t| t.name.as_str())))
    })?;
    let tuner = &study.tuners[index];
    if !tuner.active || tuner.tie.is_some() || tuner.grid != Grid::Continuous {
        return Err(within(StudyError::here(format!(
            "`{name}` cannot be swept: it is not an active, continuous tuner"
        )))
        .with_help("remove `active`, `tie`, `integer` or `values` from it"));
    }
    if tuner.case.is_some_and(|case| study.cases[case].role() != Role::Calibration) {
        return Err(within(StudyError::here(format!(
            "`{name}` cannot be swept: its experiment is not used for calibration"
        )))
        .with_help("sweep a tuner of the study, or of a calibration experiment"));
    }
    let bound = |key: &str, given: &Option<Quantity>, default: f64| -> Result<f64, StudyError> {
        let Some(quantity) = given else { return Ok(default) };
        let value = quantity.to(&tuner.unit).map_err(|why| {
            StudyError::new(key, why).with_help(format!("a number without a unit is in `{}`", tuner.unit))
        })?;
        let [low, high] = tuner.bounds;
        if (low..=high).contains(&value) {
            return Ok(value);
        }
        Err(StudyError::new(
            key,
            format!("{value} is outside the bounds of `{name}`, {low} to {}", tuner.unit.amount(high)),
        )
        .with_help("widen `min` and `max` of the tuner"))
    };
    let range = [bound("min", &draft.min, tuner.bounds[0])?, bound("max", &draft.max, tuner.bounds[1])?];
    if range[0] >= range[1] {
        return Err(StudyError::new(
            "max",
            format!("expected `max` of the sweep of `{name}` above its `min`, found {}", range[1]),
        )
        .with_help(format!("`min` is {}", tuner.unit.amount(range[0]))));
    }
    if !(2..=MOST_POINTS).contains(&draft.points) {
        return Err(StudyError::new("points", format!("expected 2 to {MOST_POINTS} points, found {}", draft.points))
            .with_help("41 points along each of two tuners are 1681 evaluations"));
    }
    Ok(Axis { tuner: index, range, points: draft.points })
}
