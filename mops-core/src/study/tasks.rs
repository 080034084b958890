//! What tasks other than design and calibration are asked: as it is written down, and checked.

use super::diagnosis::{self, DiagnosisTask};
use super::distribution::Uncertain;
use super::robustness::{self, MonteCarloTask, RobustTask, SensitivityMethod, UncertaintyTask, WorstCaseTask};
use super::uncertain::{self, UncertainDraft};
use super::{Row, Study, Task};
use crate::criterion::Usage;
use crate::diagnostic::suggestion;
use crate::evaluation::Objective;
use crate::experiment::Role;
use crate::mistake::Mistake;
use crate::tuner::Grid;
use crate::unit::Quantity;

/// Where a task looks: at the start values, or at the optimum.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// At the point that solving the study gives.
    #[default]
    Optimum,
    /// At the start values of the tuners; nothing is solved.
    Start,
}

/// What the tasks of a study are asked, as it is written down.
#[derive(Debug, Clone, Default)]
pub struct TasksDraft {
    /// Of `excitation`.
    pub excitation: ExcitationDraft,
    /// Of `sensitivity`.
    pub sensitivity: SensitivityTask,
    /// Of `sweep`, if it is there.
    pub sweep: Option<SweepDraft>,
    /// Of `diagnosis`.
    pub diagnosis: DiagnosisTask,
    /// Of `pareto`.
    pub pareto: ParetoTask,
    /// Parameters that are not known exactly, by name.
    pub uncertain: Vec<(String, UncertainDraft)>,
    /// Of `worst-case`.
    pub worst_case: WorstCaseTask,
    /// Of a design against the worst cases, if it is one.
    pub robust: Option<RobustTask>,
    /// Of `monte-carlo`.
    pub monte_carlo: MonteCarloTask,
    /// Of the uncertainty of a calibration's estimates, if more than standard errors are asked for.
    pub uncertainty: Option<UncertaintyTask>,
}

/// What the tasks of a study are asked.
#[derive(Debug, Clone, Default)]
pub struct Tasks {
    /// Of `excitation`.
    pub excitation: ExcitationTask,
    /// Of `sensitivity`.
    pub sensitivity: SensitivityTask,
    /// Of `sweep`, if it is there.
    pub sweep: Option<SweepTask>,
    /// Of `diagnosis`.
    pub diagnosis: DiagnosisTask,
    /// Of `pareto`.
    pub pareto: ParetoTask,
    /// Parameters that are not known exactly.
    pub uncertain: Vec<Uncertain>,
    /// Of `worst-case`.
    pub worst_case: WorstCaseTask,
    /// Of a design against the worst cases, if it is one.
    pub robust: Option<RobustTask>,
    /// Of `monte-carlo`.
    pub monte_carlo: MonteCarloTask,
    /// Of the uncertainty of a calibration's estimates, if more than standard errors are asked for.
    pub uncertainty: Option<UncertaintyTask>,
}

/// Which inputs are looked at, as it is written down.
#[derive(Debug, Clone, Default)]
pub struct ExcitationDraft {
    /// The inputs; all where absent.
    pub inputs: Option<Vec<String>>,
    /// Time between two samples, s.
    pub sample_time: Option<f64>,
    /// Standard deviation of the noise on inputs.
    pub noise: Vec<(String, Quantity)>,
    /// Number of parameters to be estimated.
    pub parameters: Option<usize>,
    /// FIR and ARX models, by name.
    pub regressions: Vec<(String, RegressionDraft)>,
}

/// Which inputs are looked at, and how.
#[derive(Debug, Clone, Default)]
pub struct ExcitationQuestion {
    /// The inputs; all where absent.
    pub inputs: Option<Vec<String>>,
    /// Time between two samples, s; that of the recording where absent.
    pub sample_time: Option<f64>,
    /// Standard deviation of the noise on inputs, in the models' units.
    pub noise: Vec<(String, f64)>,
    /// Number of parameters to be estimated; that of the tuners that act in the case where absent.
    pub parameters: Option<usize>,
}

/// Which inputs are looked at.
#[derive(Debug, Clone, Default)]
pub struct ExcitationTask {
    /// What is asked of inputs.
    pub question: ExcitationQuestion,
    /// FIR and ARX models.
    pub regressions: Vec<RegressionTask>,
}

/// A FIR or ARX model as it is written down.
#[derive(Debug, Clone)]
pub struct RegressionDraft {
    /// The experiment; the only one with the output where absent.
    pub experiment: Option<String>,
    /// The input.
    pub input: String,
    /// The measured output.
    pub output: String,
    /// Number of past outputs.
    pub a: usize,
    /// Number of past inputs.
    pub b: usize,
    /// Samples from input to output.
    pub delay: usize,
    /// Forgetting factor of the recursive estimate.
    pub forgetting: f64,
}

/// A FIR or ARX model of an experiment.
#[derive(Debug, Clone)]
pub struct RegressionTask {
    /// Name.
    pub name: String,
    /// The experiment, by index into the cases.
    pub case: usize,
    /// The input.
    pub input: String,
    /// The measured output.
    pub output: String,
    /// Number of past outputs.
    pub a: usize,
    /// Number of past inputs.
    pub b: usize,
    /// Samples from input to output.
    pub delay: usize,
    /// Forgetting factor of the recursive estimate.
    pub forgetting: f64,
}

/// Where sensitivities are taken.
#[derive(Debug, Clone, Copy, Default)]
pub struct SensitivityTask {
    /// The point.
    pub at: Place,
    /// Share of the largest singular value below which one counts as zero; that of the slopes' accuracy where absent.
    pub zero: Option<f64>,
    /// Slopes at the point, or effects over the uncertain parameters.
    pub method: SensitivityMethod,
    /// Of `morris` the number of trajectories, of `sobol` that of samples; their defaults where absent.
    pub samples: Option<usize>,
}

/// Which tuners are swept, as it is written down.
#[derive(Debug, Clone)]
pub struct SweepDraft {
    /// The tuner along x.
    pub x: AxisDraft,
    /// The tuner along y; without it the sweep is a line.
    pub y: Option<AxisDraft>,
    /// Where the other tuners stand.
    pub at: Place,
}

/// A swept tuner as it is written down.
#[derive(Debug, Clone)]
pub struct AxisDraft {
    /// Name.
    pub tuner: String,
    /// Smallest value; that of the tuner where absent.
    pub min: Option<Quantity>,
    /// Largest value; that of the tuner where absent.
    pub max: Option<Quantity>,
    /// Number of values.
    pub points: usize,
}

/// Which tuners are swept.
#[derive(Debug, Clone)]
pub struct SweepTask {
    /// The tuner along x.
    pub x: Axis,
    /// The tuner along y.
    pub y: Option<Axis>,
    /// Where the other tuners stand.
    pub at: Place,
}

/// A swept tuner.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Index into [`Study::tuners`].
    pub tuner: usize,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Number of values.
    pub points: usize,
}

/// How many points a front has.
#[derive(Debug, Clone, Copy)]
pub struct ParetoTask {
    /// Number of points, about.
    pub points: usize,
}

impl Default for ParetoTask {
    fn default() -> Self {
        Self { points: 30 }
    }
}

/// More points of a front than this are refused.
const MOST_OF_FRONT: usize = 200;

/// More values than this along an axis are refused.
const MOST_POINTS: usize = 1000;

pub(super) fn build(draft: TasksDraft, study: &Study) -> Result<Tasks, Mistake> {
    let excitation = excitation(draft.excitation, study).map_err(|m| m.within("excitation"))?;
    if let Some(zero) = draft.sensitivity.zero
        && !(zero > 0.0 && zero < 1.0)
    {
        return Err(Mistake::new(
            "zero",
            format!("a share of the largest singular value lies between 0 and 1, not at {zero}"),
        )
        .with_help("leave `zero` out for the accuracy of the slopes")
        .within("sensitivity"));
    }
    let sweep = draft.sweep.map(|sweep| self::sweep(sweep, study)).transpose().map_err(|m| m.within("sweep"))?;
    if study.task == Task::Sweep && sweep.is_none() {
        return Err(Mistake::new("task", "nothing says which tuners are swept")
            .with_help("add [sweep] with x = \"tuner\" and, for a surface, y = \"tuner\"")
            .within("study"));
    }
    if study.task == Task::Excitation && study.cases.iter().all(|case| case.inputs.is_empty()) {
        return Err(Mistake::new("task", "nothing drives the model: no case and no experiment has an input")
            .with_help("give one `inputs`, such as inputs = { u = { step = { after = 1.0 } } }")
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

fn pareto(task: ParetoTask, study: &Study) -> Result<ParetoTask, Mistake> {
    if !(3..=MOST_OF_FRONT).contains(&task.points) {
        let fact = format!("a front takes 3 to {MOST_OF_FRONT} points, not {}", task.points);
        return Err(Mistake::new("points", fact).with_help("30, the default, draw a smooth curve").within("pareto"));
    }
    if study.task != Task::Pareto {
        return Ok(task);
    }
    if study.objective != Objective::Each {
        return Err(Mistake::new("objective", "on a front every criterion counts for itself")
            .with_help("remove `objective`, or say objective = \"each\"")
            .within("study"));
    }
    let counts = |row: &&Row| row.usage == Usage::Minimise && study.case_of(row).role() == Role::Calibration;
    let minimised: Vec<&Row> = study.rows.iter().filter(counts).collect();
    if minimised.len() < 2 {
        let known = minimised.first().map_or_else(|| "none is".to_owned(), |row| format!("only `{}` is", row.name));
        return Err(Mistake::new("task", format!("a front needs two criteria to be minimised, and {known}"))
            .with_help("leave `usage` out of another criterion, or say usage = \"minimise\"")
            .within("study"));
    }
    Ok(task)
}

fn excitation(draft: ExcitationDraft, study: &Study) -> Result<ExcitationTask, Mistake> {
    let known: Vec<&str> =
        study.cases.iter().flat_map(|case| case.inputs.iter().map(|(name, _)| name.as_str())).collect();
    let check = |name: &str| -> Result<(), Mistake> {
        if known.contains(&name) {
            return Ok(());
        }
        Err(Mistake::new(name, format!("no case and no experiment has an input `{name}`"))
            .with_help(suggestion(name, known.iter().copied())))
    };
    for name in draft.inputs.iter().flatten() {
        check(name).map_err(|m| m.within("inputs"))?;
    }
    if let Some(time) = draft.sample_time.filter(|time| !(time.is_finite() && *time > 0.0)) {
        return Err(Mistake::new("sample-time", format!("the time between samples must be positive, not {time} s"))
            .with_help("leave it out for that of the recording"));
    }
    let mut noise = Vec::new();
    for (name, quantity) in draft.noise {
        let within = |m: Mistake| m.within("noise");
        check(&name).map_err(within)?;
        let variables = study.models.iter().flat_map(|(_, m)| &m.interface().inputs);
        let unit = &variables.into_iter().find(|v| v.name == name).expect("inputs of cases are those of models").unit;
        let value = quantity.to(unit).map_err(|why| {
            within(Mistake::new(&name, why).with_help(format!("a number without a unit counts in `{unit}`")))
        })?;
        if !(value.is_finite() && value > 0.0) {
            return Err(within(
                Mistake::new(&name, format!("a standard deviation must be positive, not {value}"))
                    .with_help("leave it out where it is not known"),
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

fn regression(name: String, draft: RegressionDraft, study: &Study) -> Result<RegressionTask, Mistake> {
    let RegressionDraft { experiment, input, output, a, b, delay, forgetting } = draft;
    let measures = |i: &usize| study.cases[*i].experiment.as_ref().is_some_and(|e| e.channel(&output).is_some());
    let case = match &experiment {
        Some(wanted) => {
            let measured = || study.cases.iter().filter(|c| c.experiment.is_some()).map(|c| c.name.as_str());
            let found =
                study.cases.iter().position(|c| c.name == *wanted && c.experiment.is_some()).ok_or_else(|| {
                    Mistake::new("experiment", format!("the study has no experiment `{wanted}`"))
                        .with_help(suggestion(wanted, measured().collect::<Vec<_>>()))
                })?;
            let channels = study.cases[found].experiment.iter().flat_map(|e| &e.channels).map(|c| c.signal.as_str());
            if !measures(&found) {
                return Err(Mistake::new("output", format!("the experiment `{wanted}` does not measure `{output}`"))
                    .with_help(suggestion(&output, channels.collect::<Vec<_>>())));
            }
            found
        }
        None => (0..study.cases.len()).find(measures).ok_or_else(|| {
            Mistake::new("output", format!("no experiment measures `{output}`"))
                .with_help("add it to the `channels` of an experiment")
        })?,
    };
    let inputs = &study.cases[case].inputs;
    if !inputs.iter().any(|(known, _)| *known == input) {
        return Err(Mistake::new(
            "input",
            format!("the experiment `{}` has no input `{input}`", study.cases[case].name),
        )
        .with_help(match inputs.is_empty() {
            true => "nothing drives it: give it `inputs`".to_owned(),
            false => suggestion(&input, inputs.iter().map(|(known, _)| known.as_str())),
        }));
    }
    if b == 0 {
        return Err(Mistake::new("b", "a model without past inputs has nothing to do with the input")
            .with_help("`b` counts the coefficients of the input: at least 1"));
    }
    if a + b > 200 {
        return Err(Mistake::new("b", format!("{} coefficients are more than 200", a + b))
            .with_help("take a longer sample time, or an ARX model: its `a` shortens the response"));
    }
    if !(forgetting > 0.0 && forgetting <= 1.0) {
        return Err(Mistake::new(
            "forgetting",
            format!("a forgetting factor lies between 0 and 1, not at {forgetting}"),
        )
        .with_help("1 forgets nothing; 0.98 forgets within about fifty samples"));
    }
    Ok(RegressionTask { name, case, input, output, a, b, delay, forgetting })
}

fn sweep(draft: SweepDraft, study: &Study) -> Result<SweepTask, Mistake> {
    let x = axis(draft.x, study).map_err(|m| m.within("x"))?;
    let y = draft.y.map(|y| axis(y, study)).transpose().map_err(|m| m.within("y"))?;
    if y.as_ref().is_some_and(|y| y.tuner == x.tuner) {
        return Err(Mistake::new("y", format!("x and y are the same tuner `{}`", study.tuners[x.tuner].name))
            .with_help("name another, or leave `y` out for a line"));
    }
    Ok(SweepTask { x, y, at: draft.at })
}

fn axis(draft: AxisDraft, study: &Study) -> Result<Axis, Mistake> {
    let name = &draft.tuner;
    let within = |m: Mistake| m.within("tuner");
    let index = study.tuners.iter().position(|t| t.name == *name).ok_or_else(|| {
        within(Mistake::here(format!("the study has no tuner `{name}`")))
            .with_help(suggestion(name, study.tuners.iter().map(|t| t.name.as_str())))
    })?;
    let tuner = &study.tuners[index];
    if !tuner.active || tuner.tie.is_some() || tuner.grid != Grid::Continuous {
        return Err(within(Mistake::here(format!("`{name}` cannot be swept: it is no active, continuous tuner")))
            .with_help("remove `active`, `tie`, `integer` or `values` from it"));
    }
    if tuner.case.is_some_and(|case| study.cases[case].role() != Role::Calibration) {
        return Err(within(Mistake::here(format!("`{name}` cannot be swept: its experiment moves no tuner")))
            .with_help("sweep a tuner of the study, or of a calibration experiment"));
    }
    let bound = |key: &str, given: &Option<Quantity>, default: f64| -> Result<f64, Mistake> {
        let Some(quantity) = given else { return Ok(default) };
        let value = quantity.to(&tuner.unit).map_err(|why| {
            Mistake::new(key, why).with_help(format!("a number without a unit counts in `{}`", tuner.unit))
        })?;
        let [low, high] = tuner.bounds;
        if (low..=high).contains(&value) {
            return Ok(value);
        }
        Err(Mistake::new(
            key,
            format!("{value} lies outside the bounds of `{name}`, {low} to {}", tuner.unit.amount(high)),
        )
        .with_help("a sweep stays where the tuner may be; widen its `min` and `max`"))
    };
    let range = [bound("min", &draft.min, tuner.bounds[0])?, bound("max", &draft.max, tuner.bounds[1])?];
    if range[0] >= range[1] {
        return Err(Mistake::new(
            "max",
            format!("the sweep of `{name}` must end above its start, not at {}", range[1]),
        )
        .with_help(format!("it starts at {}", tuner.unit.amount(range[0]))));
    }
    if !(2..=MOST_POINTS).contains(&draft.points) {
        return Err(Mistake::new("points", format!("a sweep takes 2 to {MOST_POINTS} values, not {}", draft.points))
            .with_help("41 along each of two tuners make 1681 points"));
    }
    Ok(Axis { tuner: index, range, points: draft.points })
}
