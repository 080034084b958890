//! What a run leaves behind: the content of `result.json`. Numbers that are not finite are written as null.

use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::criterion::Usage;
use crate::demand::Demand;
use crate::evaluation::Evaluation;
use crate::experiment::Role;
use crate::identification::{ExcitationReport, RegressionReport, SensitivityReport, Whiteness};
use crate::robustness::{GlobalSensitivityReport, MonteCarloReport, RobustReport, WorstCaseReport};
use crate::slopes::SlopesReport;
use crate::solver::Stop;
use crate::study::{Study, Task};
use crate::trade_offs::{Pareto, TradeOffs};
use crate::uncertainty::UncertaintyReport;

/// The result of a run.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    /// Version of this format.
    pub format: u32,
    /// Version of the program.
    pub mops: &'static str,
    /// Name of the study.
    pub study: String,
    /// What it is for.
    pub task: Task,
    /// Seed of all random streams.
    pub seed: u64,
    /// Kind of the solver.
    pub solver: String,
    /// Kinds of the solvers that a composite one has run, in the order in which they began; absent where it is none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub methods: Vec<&'static str>,
    /// Which run of the command line it is the result of: a digest of what it was asked, as its database has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub run: Option<String>,
    /// Why the run stopped.
    pub stop: Stop,
    /// Points evaluated.
    pub evaluations: usize,
    /// Of a run that uses points of another again: how many of its own were known, and not simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reused: Option<usize>,
    /// Models run; points that were known count as if they were simulated.
    pub simulations: usize,
    /// Wall-clock time, s.
    pub seconds: f64,
    /// Whether every constraint holds.
    pub feasible: bool,
    /// The largest weighted scaled value among those minimised.
    pub worst_scaled: f64,
    /// What was minimised: the worst scaled value of a design, the sum of a calibration.
    pub objective: f64,
    /// The largest violation of a constraint, in scaled values.
    pub violation: f64,
    /// Whether one criterion can be improved at no cost.
    pub pareto: Pareto,
    /// The tuners at the best point.
    pub tuners: Vec<TunerReport>,
    /// The criteria at the best point.
    pub criteria: Vec<CriterionReport>,
    /// The same at the start values.
    pub start: StartReport,
    /// Points of the front; of a single design, the design itself.
    pub front: Vec<Value>,
    /// Of a calibration: estimates and errors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<CalibrationReport>,
    /// What tasks other than design and calibration found: a block for each.
    #[serde(flatten)]
    pub found: Findings,
    /// What failed on the way.
    pub failures: Vec<FailureReport>,
    /// What a reader should know.
    pub warnings: Vec<String>,
}

/// What tasks other than design and calibration found.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Findings {
    /// How rich the inputs are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excitation: Option<ExcitationFindings>,
    /// What the data or the criteria tell of the tuners.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity: Option<SensitivityReport>,
    /// Of a design: how the criteria change with the tuners at the reported point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slopes: Option<SlopesReport>,
    /// The objective over one tuner or two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweep: Option<SweepReport>,
    /// What the points of the front tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trade_offs: Option<TradeOffs>,
    /// What the model lacks, as the search for it writes it down.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diagnosis: Option<Value>,
    /// The worst cases over a box of uncertain parameters.
    #[serde(rename = "worst-case", skip_serializing_if = "Option::is_none")]
    pub worst_case: Option<WorstCaseReport>,
    /// How the criteria are distributed.
    #[serde(rename = "monte-carlo", skip_serializing_if = "Option::is_none")]
    pub monte_carlo: Option<MonteCarloReport>,
    /// How a design against worst cases was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robust: Option<RobustReport>,
    /// What more is told of the uncertainty of a calibration's estimates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<UncertaintyReport>,
    /// Effects of the uncertain parameters over their whole ranges.
    #[serde(rename = "global-sensitivity", skip_serializing_if = "Option::is_none")]
    pub global_sensitivity: Option<GlobalSensitivityReport>,
}

/// How rich inputs are, and what regressions make of them.
#[derive(Debug, Clone, Serialize)]
pub struct ExcitationFindings {
    /// Every input of every case.
    pub inputs: Vec<ExcitationReport>,
    /// FIR and ARX models.
    pub regressions: Vec<RegressionReport>,
}

/// The objective over one tuner or two.
#[derive(Debug, Clone, Serialize)]
pub struct SweepReport {
    /// The findings in sentences; names stand between backticks.
    pub words: Vec<String>,
    /// The tuner along x.
    pub x: SweepAxis,
    /// The tuner along y, if there is one.
    pub y: Option<SweepAxis>,
    /// The objective: one row per value of y (a single one without y), with one number per value of x; null where a
    /// simulation failed.
    pub objective: Vec<Vec<f64>>,
    /// The largest violation of a constraint, in scaled values, likewise.
    pub violation: Vec<Vec<f64>>,
    /// Value of x, of y (null without y), and objective at the best point of the sweep.
    pub best: [f64; 3],
    /// The same at the point around which it was made.
    pub centre: [f64; 3],
}

/// A swept tuner.
#[derive(Debug, Clone, Serialize)]
pub struct SweepAxis {
    /// Name.
    pub tuner: String,
    /// Unit of the values.
    pub unit: String,
    /// Whether the values are spread evenly in the logarithm.
    pub log: bool,
    /// The values.
    pub values: Vec<f64>,
}

/// A tuner of a result.
#[derive(Debug, Clone, Serialize)]
pub struct TunerReport {
    /// Name.
    pub name: String,
    /// Value at the best point.
    pub value: f64,
    /// Value at the start.
    pub start: f64,
    /// Smallest and largest value.
    pub bounds: [f64; 2],
    /// Unit of all of these.
    pub unit: String,
    /// `lower` or `upper` where the value is at that bound.
    pub at_bound: Option<&'static str>,
    /// Whether the solver could change it.
    pub active: bool,
}

/// A criterion of a result, in one case.
#[derive(Debug, Clone, Serialize)]
pub struct CriterionReport {
    /// Name.
    pub name: String,
    /// The model it reads.
    pub model: String,
    /// The case.
    pub case: String,
    /// What the study does with it.
    pub usage: Usage,
    /// The demand; null where `good` and `bad` stand for it, or nothing was asked.
    pub demand: Option<f64>,
    /// Value that scales to 0, where given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub good: Option<f64>,
    /// Value that scales to 1, where given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bad: Option<f64>,
    /// The value; null where what the criterion asks for was never reached, or nothing could be computed.
    pub value: f64,
    /// The scaled value, at most 1 where the demand is met. A demand `d` is the largest value that is accepted for a kind of which
    /// less is better, and scales `c/d`; it is the smallest for one of which more is better, and scales `1 + (d - c)/|d|`. A pair
    /// scales `(c - good)/(bad - good)`. What was never reached counts `max(1, h/d) (1 + e/(e + b))`: `h` is the time in
    /// which it could have been reached, `e` the mean distance of the signal from where it should be over the last tenth of that
    /// time, `b` the half-width of the band (for levels 1 % of the step); `1 + e/(e + b)` under a pair, and for a kind
    /// that is no time.
    pub scaled: f64,
    /// Unit of the value.
    pub unit: String,
    /// Whether the demand is met; true where there is none, never where the value was not reached.
    pub met: bool,
    /// Whether more is asked for, not less.
    #[serde(skip)]
    pub at_least: bool,
    /// What a reader must know of the value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<&'static str>,
}

/// The result at the start values.
#[derive(Debug, Clone, Serialize)]
pub struct StartReport {
    /// Whether every constraint holds.
    pub feasible: bool,
    /// The largest weighted scaled value among those minimised.
    pub worst_scaled: f64,
    /// What was minimised.
    pub objective: f64,
    /// The criteria.
    pub criteria: Vec<CriterionReport>,
}

/// What a calibration gives beside its tuners.
#[derive(Debug, Clone, Serialize)]
pub struct CalibrationReport {
    /// Estimates, with what the data tell of their uncertainty.
    pub parameters: Vec<ParameterReport>,
    /// How well each experiment is met.
    pub experiments: Vec<ExperimentReport>,
    /// Which tuners, or which combinations of them, the data determine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity: Option<SensitivityReport>,
    /// How rich the inputs of the experiments are; empty where nothing is driven.
    pub excitation: Vec<ExcitationReport>,
}

/// An estimated parameter.
#[derive(Debug, Clone, Serialize)]
pub struct ParameterReport {
    /// Name.
    pub name: String,
    /// Estimate.
    pub value: f64,
    /// Standard error to first order; null where the data do not determine it.
    pub std_error: f64,
    /// 95 % interval: estimate +- t quantile times standard error, within the bounds; null where the data do not determine
    /// it.
    pub interval95: [f64; 2],
    /// Unit of all of these.
    pub unit: String,
}

/// How well an experiment is met.
#[derive(Debug, Clone, Serialize)]
pub struct ExperimentReport {
    /// Name.
    pub name: String,
    /// What it is used for.
    pub role: Role,
    /// Its channels.
    pub channels: Vec<ChannelReport>,
}

/// How well a channel is met.
#[derive(Debug, Clone, Serialize)]
pub struct ChannelReport {
    /// The measured signal.
    pub name: String,
    /// Root of the mean square of measured - simulated.
    pub rmse: f64,
    /// Standard deviation of the noise, where known.
    pub noise: Option<f64>,
    /// `100 (1 - |y - yhat| / |y - mean y|)`.
    pub fit_percent: f64,
    /// Unit of error and noise.
    pub unit: String,
    /// Whether its residuals are white; absent for too few of them, or where nothing was simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub whiteness: Option<Whiteness>,
}

/// Simulations that failed.
#[derive(Debug, Clone, Serialize)]
pub struct FailureReport {
    /// The model.
    pub model: String,
    /// The case.
    pub case: String,
    /// Kind of failure.
    pub failure: String,
    /// The first of them, in words.
    pub first: String,
    /// How often.
    pub count: usize,
}

/// The tuners of an evaluation, beside their start values.
pub(crate) fn tuners(study: &Study, at: &Evaluation) -> Vec<TunerReport> {
    let start = study.start();
    let report = |(i, tuner): (usize, &crate::tuner::Tuner)| TunerReport {
        name: tuner.name.clone(),
        value: at.tuners[i],
        start: start[i],
        bounds: tuner.bounds,
        unit: tuner.unit.to_string(),
        at_bound: if tuner.active { tuner.at_bound(at.tuners[i]) } else { None },
        active: tuner.active,
    };
    study.tuners.iter().enumerate().map(report).collect()
}

/// The criteria of an evaluation.
pub fn criterion_reports(study: &Study, at: &Evaluation) -> Vec<CriterionReport> {
    let report = |(row, reading): (&crate::study::Row, &Option<crate::evaluation::Reading>)| {
        let plan = &study.jobs[row.job];
        let scaled = reading.map_or(f64::NAN, |r| r.scaled);
        let (demand, good, bad) = match row.demand {
            Demand::AtMost(demand) | Demand::AtLeast(demand) => (Some(demand), None, None),
            Demand::Pair { good, bad } => (None, Some(good), Some(bad)),
            Demand::None => (None, None, None),
        };
        CriterionReport {
            name: row.name.clone(),
            model: study.models[plan.model].0.clone(),
            case: study.cases[plan.case].name.clone(),
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
    study.rows.iter().zip(&at.readings).map(report).collect()
}

/// The largest weighted scaled value among the rows minimised in calibration cases; NaN if one has none.
pub(crate) fn worst_scaled(study: &Study, at: &Evaluation) -> f64 {
    let counts =
        |row: &&crate::study::Row| row.usage == Usage::Minimise && study.case_of(row).role() == Role::Calibration;
    let rows = study.rows.iter().zip(&at.readings).filter(|(row, _)| counts(row));
    rows.map(|(row, reading)| reading.map_or(f64::NAN, |r| row.weight * r.scaled))
        .reduce(|a, b| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) })
        .unwrap_or(0.0)
}

/// A point of a front: its tuners and its criteria.
pub(crate) fn front_point(study: &Study, at: &Evaluation) -> Value {
    let tuners: Map<String, Value> =
        study.tuners.iter().zip(&at.tuners).map(|(t, &v)| (t.name.clone(), json!(v))).collect();
    let criteria: Map<String, Value> = study
        .rows
        .iter()
        .zip(&at.readings)
        .map(|(row, reading)| (study.key(row), json!(reading.map(|r| r.value))))
        .collect();
    json!({ "tuners": tuners, "criteria": criteria })
}
