//! Result of a run: the content of `result.json`. Non-finite numbers are written as null.

use std::collections::BTreeMap;

use mops_core::{
    case::Role,
    criterion::{Demand, Usage},
    evaluation::{Evaluation, Objective},
    problem::{FrontObjective, Problem},
    solver::{Pareto, Stop},
    study::Study,
};
use mops_identification::Whiteness;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema};
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::identification::{ExcitationReport, SensitivityReport};
use crate::{BlockKind, End, Findings};

/// The result of a run.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[non_exhaustive]
pub struct Outcome {
    /// Version of this format.
    pub format: u32,
    /// Version of the program.
    pub mops: &'static str,
    /// Name of the study.
    pub study: String,
    /// Task of the study.
    pub task: &'static str,
    /// Seed of all random streams.
    pub seed: u64,
    /// Kind of the solver.
    pub solver: String,
    /// Kinds of the solvers that a composite solver has run, in order of their start; absent for other solvers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub methods: Vec<&'static str>,
    /// Identifier of the command-line run with this result: a digest of its request, as stored in its database.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub run: Option<String>,
    /// Why the run stopped.
    pub stop: Stop,
    /// What is known of the reported point; absent if nothing was solved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<End>,
    /// Number of evaluated points.
    pub evaluations: usize,
    /// Number of evaluated points taken from another run without simulation; absent if no run was reused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reused: Option<usize>,
    /// Number of simulations; cached points count as if simulated.
    pub simulations: usize,
    /// Wall-clock time, s.
    pub seconds: f64,
    /// True if all constraints are satisfied.
    pub feasible: bool,
    /// The largest weighted scaled value among those minimised.
    pub worst_scaled: f64,
    /// Minimised objective: the worst scaled value of a design, the sum of a calibration.
    pub objective: f64,
    /// The largest violation of a constraint, in scaled values.
    pub violation: f64,
    /// Pareto optimality of the result.
    pub pareto: Pareto,
    /// The tuners at the best point.
    pub tuners: Vec<TunerReport>,
    /// The criteria at the best point.
    pub criteria: Vec<CriterionReport>,
    /// Criteria and objective at the initial guess.
    pub start: StartReport,
    /// Points of the Pareto front; for a single design, the design itself.
    pub front: Vec<Design>,
    /// Estimates and errors of a calibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<CalibrationReport>,
    /// Findings of the task, one block each.
    #[serde(flatten)]
    #[schemars(skip)]
    pub found: Findings,
    /// Failures during the run.
    pub failures: Vec<FailureReport>,
    /// Warnings.
    pub warnings: Vec<String>,
}

/// Tuner values in a result.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[non_exhaustive]
pub struct TunerReport {
    /// Name.
    pub name: String,
    /// Value at the best point.
    pub value: f64,
    /// Initial guess.
    pub start: f64,
    /// Smallest and largest value.
    pub bounds: [f64; 2],
    /// Unit of the values and bounds.
    pub unit: String,
    /// `lower` or `upper` if the value is at that bound.
    pub at_bound: Option<&'static str>,
    /// True if the solver could change the tuner.
    pub active: bool,
}

/// Values of the tuners and the criteria at a point of a Pareto front.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[non_exhaustive]
pub struct Design {
    /// Values of all tuners, by name.
    #[schemars(with = "BTreeMap<String, f64>")]
    pub tuners: Map<String, Value>,
    /// Values of all criteria, by `case/criterion`.
    #[schemars(with = "BTreeMap<String, f64>")]
    pub criteria: Map<String, Value>,
    /// Values of the objectives of a Pareto front: of every minimised criterion in its worst case, which has the
    /// largest weighted scaled value, by name; under `per-case`, by `case/criterion` where a criterion is minimised in
    /// several cases. Absent for a single design.
    #[schemars(with = "BTreeMap<String, f64>")]
    #[serde(skip_serializing_if = "Map::is_empty")]
    pub objectives: Map<String, Value>,
}

/// Criterion values in a result, for one case.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[non_exhaustive]
pub struct CriterionReport {
    /// Name.
    pub name: String,
    /// Model that the criterion reads.
    pub model: String,
    /// Name of the case.
    pub case: String,
    /// Usage of the criterion in the study.
    pub usage: Usage,
    /// Demand; null if `good` and `bad` replace it, or if there is no demand.
    pub demand: Option<f64>,
    /// Value that scales to 0, if given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub good: Option<f64>,
    /// Value that scales to 1, if given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bad: Option<f64>,
    /// Value; null if the condition of the criterion was never reached, or if the value could not be computed.
    pub value: f64,
    /// Scaled value, at most 1 if the demand is met. A demand `d` is the upper limit `c <= d` if less is better, with
    /// the scaled value `c/d`. It is the lower limit `c >= d` if more is better, with the scaled value
    /// `1 + (d - c)/|d|`. A pair scales to `(c - good)/(bad - good)`.
    ///
    /// A condition that was never reached scales to `max(1, h/d) (1 + e/(e + b))`. Under a pair, and for a criterion
    /// that is not a time, it scales to `1 + e/(e + b)`. `h` is the time available to reach the condition. `e` is the
    /// mean distance of the signal from its target over the last tenth of that time. `b` is the half-width of the band
    /// (for levels 1 % of the step).
    pub scaled: f64,
    /// Unit of the value.
    pub unit: String,
    /// True if the demand is met, false if it is not or if the criterion has no value; null without a demand.
    pub met: Option<bool>,
    /// True if the demand is a lower limit.
    #[serde(skip)]
    pub at_least: bool,
    /// Remark on the value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<&'static str>,
}

/// Result at the initial guess.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[non_exhaustive]
pub struct StartReport {
    /// True if all constraints are satisfied.
    pub feasible: bool,
    /// The largest weighted scaled value among those minimised.
    pub worst_scaled: f64,
    /// Minimised objective.
    pub objective: f64,
    /// Criteria at the initial guess.
    pub criteria: Vec<CriterionReport>,
}

impl StartReport {
    /// Returns the report of an evaluation at the initial guess.
    pub fn of(study: &Study, start: &Evaluation) -> Self {
        Self {
            feasible: start.merit.is_feasible(),
            worst_scaled: worst_scaled(study, start),
            objective: start.merit.objective,
            criteria: criterion_reports(study, start),
        }
    }
}

/// Results of a calibration in addition to the tuners.
#[derive(Debug, Clone, Default, Serialize, JsonSchema)]
#[non_exhaustive]
pub struct CalibrationReport {
    /// Estimates and their uncertainty.
    pub parameters: Vec<ParameterReport>,
    /// Fit of each experiment.
    pub experiments: Vec<ExperimentReport>,
    /// Tuners, and combinations of tuners, that the data determine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity: Option<SensitivityReport>,
    /// Order of persistent excitation of the inputs of the experiments; empty if no input is driven.
    pub excitation: Vec<ExcitationReport>,
}

/// An estimated parameter.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[non_exhaustive]
pub struct ParameterReport {
    /// Name.
    pub name: String,
    /// Estimate.
    pub value: f64,
    /// Standard error to first order; null if the data do not determine the parameter.
    pub std_error: f64,
    /// 95 % confidence interval: estimate +- t quantile times standard error, clamped to the bounds. Null if the data
    /// do not determine the parameter.
    pub interval95: [f64; 2],
    /// Unit of the estimate, error and interval.
    pub unit: String,
}

/// Fit of an experiment.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[non_exhaustive]
pub struct ExperimentReport {
    /// Name.
    pub name: String,
    /// Role of the experiment.
    pub role: Role,
    /// Fit of each channel.
    pub channels: Vec<ChannelReport>,
}

/// Fit of a channel.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[non_exhaustive]
pub struct ChannelReport {
    /// Name of the measured signal.
    pub name: String,
    /// Root mean square of measured - simulated.
    pub rmse: f64,
    /// Standard deviation of the noise, if known.
    pub noise: Option<f64>,
    /// Fit in percent: `100 (1 - |y - yhat| / |y - mean y|)`.
    pub fit_percent: f64,
    /// Unit of the error and the noise.
    pub unit: String,
    /// Whiteness of the residuals; absent if there are too few residuals or no simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub whiteness: Option<Whiteness>,
}

/// Failed simulations of one kind.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[non_exhaustive]
pub struct FailureReport {
    /// Name of the model.
    pub model: String,
    /// Name of the case.
    pub case: String,
    /// Kind of failure.
    pub failure: String,
    /// Description of the first failure.
    pub first: String,
    /// Number of failures.
    pub count: usize,
}

/// Returns the tuner values of an evaluation, with the initial guess.
pub(crate) fn tuners(study: &Study, at: &Evaluation) -> Vec<TunerReport> {
    let start = study.start();
    let report = |(i, tuner): (usize, &mops_core::study::Tuner)| TunerReport {
        name: tuner.name.clone(),
        value: at.tuners[i],
        start: start[i],
        bounds: tuner.bounds,
        unit: tuner.unit.to_string(),
        at_bound: if tuner.active { tuner.at_bound(at.tuners[i]) } else { None },
        active: tuner.active,
    };
    study.tuners().iter().enumerate().map(report).collect()
}

/// Returns the criterion values of an evaluation.
pub fn criterion_reports(study: &Study, at: &Evaluation) -> Vec<CriterionReport> {
    let report = |(row, reading): (&mops_core::study::Row, &Option<mops_core::evaluation::Reading>)| {
        let plan = &study.jobs()[row.job];
        let scaled = reading.map_or(f64::NAN, |r| r.scaled);
        let (demand, good, bad) = match row.demand {
            Demand::AtMost(demand) | Demand::AtLeast(demand) => (Some(demand), None, None),
            Demand::Pair { good, bad } => (None, Some(good), Some(bad)),
            Demand::None => (None, None, None),
        };
        CriterionReport {
            name: row.name.clone(),
            model: study.models()[plan.model].0.clone(),
            case: study.cases()[plan.case].name.clone(),
            usage: row.usage,
            demand,
            good,
            bad,
            value: reading.map_or(f64::NAN, |r| r.value),
            scaled,
            unit: row.unit.to_string(),
            met: row.is_met(scaled),
            at_least: row.demand.asks_for_more(),
            note: reading.and_then(|r| r.note),
        }
    };
    study.rows().iter().zip(&at.readings).map(report).collect()
}

/// Returns the largest weighted scaled value among the rows minimised in calibration cases; NaN if a row has no value.
pub(crate) fn worst_scaled(study: &Study, at: &Evaluation) -> f64 {
    let counts =
        |row: &&mops_core::study::Row| row.usage == Usage::Minimise && study.case_of(row).role() == Role::Calibration;
    let rows = study.rows().iter().zip(&at.readings).filter(|(row, _)| counts(row));
    rows.map(|(row, reading)| reading.map_or(f64::NAN, |r| row.weight * r.scaled))
        .reduce(|a, b| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) })
        .unwrap_or(0.0)
}

/// Returns the tuners and criteria at a point, with the objectives of a Pareto front if there is one.
pub fn design(problem: &Problem, at: &Evaluation) -> Design {
    let study = problem.study();
    let objectives = if problem.shape().objective == Objective::Each { problem.objectives() } else { Vec::new() };
    let worst = |objective: &FrontObjective| json!(objective.worst(study, at).map(|(_, reading)| reading.value));
    let value = |reading: &Option<mops_core::evaluation::Reading>| json!(reading.map(|r| r.value));
    Design {
        tuners: study.tuners().iter().zip(&at.tuners).map(|(t, &v)| (t.name.clone(), json!(v))).collect(),
        objectives: objectives.iter().map(|objective| (objective.label.clone(), worst(objective))).collect(),
        criteria: study
            .rows()
            .iter()
            .zip(&at.readings)
            .map(|(row, reading)| (study.key(row), value(reading)))
            .collect(),
    }
}

/// Returns the JSON schema of `result.json`, in which tasks may add blocks.
pub fn result_schema(blocks: &[BlockKind]) -> Value {
    let mut settings = SchemaSettings::draft07().for_serialize();
    settings.transforms.push(Box::new(RecursiveTransform(numbers_may_be_null)));
    let mut generator = settings.into_generator();
    let added: Vec<(&BlockKind, Value)> =
        blocks.iter().map(|kind| (kind, (kind.schema)(&mut generator).to_value())).collect();
    let mut schema = generator.into_root_schema_for::<Outcome>().to_value();
    for (kind, block) in added {
        // Keys beside a reference are ignored in this draft.
        schema["properties"][kind.key] = json!({ "description": kind.about, "allOf": [block] });
    }
    schema["title"] = json!("mops result");
    schema
}

/// Allows null for every number, the form of a non-finite one.
fn numbers_may_be_null(schema: &mut Schema) {
    if schema.get("type").is_some_and(|of| of == "number") {
        schema.insert("type".to_owned(), json!(["number", "null"]));
    }
}
