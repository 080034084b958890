//! Results with uncertain parameters in `result.json`: worst cases, distributions, effects.

use mops_content::{
    numbers::{known, number, precise},
    section::{Tone, Verdict},
    table::{Cell, Table, numbers, text},
};
use schemars::JsonSchema;
use serde::Serialize;

use mops_core::{
    criterion::Usage,
    study::{Distribution, Row, Study},
};
use mops_statistics::Sampling;

/// Uncertain parameter in a result.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct UncertainReport {
    /// Name of the parameter.
    pub name: String,
    /// Smallest and largest value; null if unbounded.
    pub bounds: [f64; 2],
    /// Nominal value.
    pub nominal: f64,
    /// Distribution of the values, in words.
    pub distribution: String,
    /// Unit of the values.
    pub unit: String,
}

/// Criterion that a result refers to.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Subject {
    /// Name of the criterion.
    pub criterion: String,
    /// Name of its model.
    pub model: String,
    /// Name of its case; the uncertain parameters differ from that case.
    pub case: String,
    /// Usage of the criterion in the study.
    pub usage: Usage,
    /// Value that scales to 1; null without a demand.
    pub demand: Option<f64>,
    /// True if the demand is a lower limit.
    #[serde(skip)]
    pub at_least: bool,
    /// Unit of the values.
    pub unit: String,
    /// Value for nominal parameters.
    pub nominal: f64,
}

impl Subject {
    /// Returns the demand for a reader, without its unit; empty without a demand.
    pub fn shown_demand(&self) -> String {
        let limit = if self.at_least { "at least " } else { "" };
        self.demand.map_or_else(String::new, |demand| format!("{limit}{}", number(demand)))
    }
}

/// Worst cases over a box.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct WorstCaseReport {
    /// Findings in sentences; names are between backticks.
    pub words: Vec<String>,
    /// Uncertain parameters.
    pub parameters: Vec<UncertainReport>,
    /// Worst case of every criterion.
    pub criteria: Vec<WorstReport>,
    /// Number of simulations of the searches.
    pub simulations: usize,
    /// True if proven that nothing in the box is worse; always false.
    pub guaranteed: bool,
}

/// Worst case found for a criterion.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct WorstReport {
    /// Criterion of the worst case.
    #[serde(flatten)]
    pub of: Subject,
    /// Worst value found; null if every simulation failed.
    pub value: f64,
    /// Scaled value (worst value divided by the demand); null without a demand.
    pub scaled: f64,
    /// True if the demand is met in the worst case, or if there is none.
    pub met: bool,
    /// Values of the uncertain parameters in the worst case.
    pub at: Vec<CoordinateReport>,
    /// Number of searches.
    pub starts: usize,
    /// Number of searches that ended in this worst case.
    pub ended_here: usize,
    /// Number of simulations of the searches, without those shared by all criteria.
    pub simulations: usize,
    /// Number of failed simulations, including shared ones; there the criterion has no value.
    pub failed: usize,
    /// First of these failures, with its parameter values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<FailedAt>,
    /// Values along each parameter through the worst case.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub slices: Vec<Slice>,
}

/// Failed simulation.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FailedAt {
    /// Reason for the failure.
    pub why: String,
    /// Values of the uncertain parameters.
    pub at: Vec<CoordinateReport>,
}

/// Value of an uncertain parameter at a point.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CoordinateReport {
    /// Name of the parameter.
    pub name: String,
    /// Value of the parameter.
    pub value: f64,
    /// Unit of the value.
    pub unit: String,
    /// End of the range at which the value lies, `lower` or `upper`, if any.
    pub at_bound: Option<&'static str>,
}

/// Criterion along one parameter, with the others fixed.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Slice {
    /// Name of the parameter.
    pub parameter: String,
    /// Unit of the parameter values.
    pub unit: String,
    /// Values of the parameter.
    pub x: Vec<f64>,
    /// Values of the criterion; null for failed simulations.
    pub y: Vec<f64>,
}

/// Distributions of criteria for uncertain parameters.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct MonteCarloReport {
    /// Findings in sentences; names are between backticks.
    pub words: Vec<String>,
    /// Uncertain parameters.
    pub parameters: Vec<UncertainReport>,
    /// Number of samples.
    pub samples: usize,
    /// Sampling method.
    pub method: Sampling,
    /// Confidence level of all intervals; exact for random samples.
    pub level: f64,
    /// Number of samples in which a simulation or a criterion failed.
    pub failed: usize,
    /// Distribution of every criterion.
    pub criteria: Vec<DistributionReport>,
    /// Samples that meet all demands; null without demands.
    pub all: Option<ShareReport>,
    /// Values of the uncertain parameters, then of the criteria, per sample; written as `samples.csv`.
    #[serde(skip)]
    pub table: Vec<(Vec<f64>, Vec<f64>)>,
}

/// Distribution of a criterion.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct DistributionReport {
    /// Criterion of the distribution.
    #[serde(flatten)]
    pub of: Subject,
    /// Mean of the samples with a value.
    pub mean: f64,
    /// Standard deviation of the samples with a value.
    pub deviation: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Quantiles of the values.
    pub quantiles: Vec<QuantileReport>,
    /// Samples that meet the demand; failed samples do not. Null without a demand.
    pub met: Option<ShareReport>,
    /// Number of samples without a value.
    pub failed: usize,
}

/// Quantile with its distribution-free confidence interval.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct QuantileReport {
    /// Share of the values that do not exceed the quantile.
    pub share: f64,
    /// Value of the quantile.
    pub value: f64,
    /// Confidence interval; an end is null if there are too few samples.
    pub interval: [f64; 2],
}

/// Share of samples with its confidence interval (Clopper-Pearson).
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct ShareReport {
    /// Number of samples that count.
    pub count: usize,
    /// Number of all samples.
    pub of: usize,
    /// Share of the samples that count.
    pub share: f64,
    /// Confidence interval of the share.
    pub interval: [f64; 2],
}

/// Robust design against worst cases.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct RobustReport {
    /// Findings in sentences; names are between backticks.
    pub words: Vec<String>,
    /// Uncertain parameters.
    pub parameters: Vec<UncertainReport>,
    /// Rounds, each with a design for the present cases and the worst cases found for it.
    pub rounds: Vec<RoundReport>,
    /// Index of the reported round: the one with the best worst case.
    pub chosen: usize,
    /// True if a complete search of the box found no case in which the reported design is worse than in the cases that
    /// it was designed for by more than the tolerance.
    pub settled: bool,
    /// Tolerance, in scaled values.
    pub tolerance: f64,
    /// Worst case of every criterion for the reported design.
    pub criteria: Vec<WorstReport>,
    /// True if proven that nothing in the box is worse; always false.
    pub guaranteed: bool,
}

/// Round of a robust design.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct RoundReport {
    /// Number of cases of the design problem.
    pub cases: usize,
    /// Design: values of all tuners.
    pub tuners: Vec<f64>,
    /// Worst weighted scaled value over these cases.
    pub for_cases: f64,
    /// Largest violation of a constraint over these cases, in scaled values.
    pub violation_for_cases: f64,
    /// Worst weighted scaled value found in the box.
    pub found: f64,
    /// Largest violation of a constraint found in the box.
    pub violation_found: f64,
    /// Number of points evaluated for the design.
    pub evaluations: usize,
    /// Number of simulations of the searches for worst cases.
    pub simulations: usize,
    /// Added cases.
    pub added: Vec<AddedReport>,
}

/// Added case.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct AddedReport {
    /// Name of the case.
    pub name: String,
    /// Criterion for which it is a worst case.
    pub criterion: String,
    /// Scaled value of the criterion in the case; null for a case beyond the edge of a jump, at which the criterion was
    /// not computed.
    pub scaled: Option<f64>,
    /// Values of the uncertain parameters.
    pub at: Vec<CoordinateReport>,
}

/// Effects of the uncertain parameters over their whole ranges.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct GlobalSensitivityReport {
    /// Findings in sentences; names are between backticks.
    pub words: Vec<String>,
    /// Method: `morris` or `sobol`.
    pub method: mops_core::task::SensitivityMethod,
    /// Uncertain parameters.
    pub parameters: Vec<UncertainReport>,
    /// Number of trajectories, or of samples.
    pub samples: usize,
    /// Number of trajectories or samples omitted because a simulation failed.
    pub failed: usize,
    /// Number of simulations.
    pub simulations: usize,
    /// Confidence level of the intervals.
    pub level: f64,
    /// Effects on every criterion.
    pub criteria: Vec<EffectsReport>,
}

/// Effects of the uncertain parameters on a criterion.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EffectsReport {
    /// Criterion of the effects.
    #[serde(flatten)]
    pub of: Subject,
    /// Effect of every parameter; empty if the criterion does not vary.
    pub effects: Vec<EffectReport>,
}

/// Effect of an uncertain parameter: `morris` sets the first three numbers, `sobol` the others.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EffectReport {
    /// Name of the parameter.
    pub parameter: String,
    /// Mean of the elementary effects, per range of the parameter, in the criterion's unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean: Option<f64>,
    /// Mean of the magnitudes of the elementary effects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnitude: Option<f64>,
    /// Standard deviation of the elementary effects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviation: Option<f64>,
    /// First-order Sobol index: share of the variance due to the parameter alone, with its interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first: Option<Estimated>,
    /// Total Sobol index: share of the variance due to the parameter alone and in interaction with others, with its
    /// interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub total: Option<Estimated>,
}

/// Estimate with its interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Estimated {
    /// Value of the estimate.
    pub value: f64,
    /// Confidence interval.
    pub interval: [f64; 2],
}

impl Subject {
    /// Creates the reference to a row of a study, with its value for nominal parameters.
    pub fn of(study: &Study, row: &Row, nominal: f64) -> Self {
        let plan = &study.jobs()[row.job];
        Self {
            criterion: row.name.clone(),
            model: study.models()[plan.model].0.clone(),
            case: study.cases()[plan.case].name.clone(),
            usage: row.usage,
            demand: row.demand.limit(),
            at_least: row.demand.asks_for_more(),
            unit: row.unit.to_string(),
            nominal,
        }
    }
}

/// Returns the uncertain parameters of a study created by [`Study::over_uncertain`].
pub fn uncertain_reports(study: &Study) -> Vec<UncertainReport> {
    let first = study.tuners().len() - study.uncertain().len();
    let report = |(uncertain, tuner): (&mops_core::study::Uncertain, &mops_core::study::Tuner)| {
        let unit = uncertain.unit.to_string();
        let amount = |value: f64| format!("{:.4e}", value).parse::<f64>().map_or(value.to_string(), |v| v.to_string());
        let distribution = match uncertain.distribution {
            Distribution::Uniform => "uniform".to_owned(),
            Distribution::Normal { mean, deviation } => {
                format!("normal, mean {}, standard deviation {}", amount(mean), amount(deviation))
            }
            Distribution::LogNormal { median, deviation } => {
                format!(
                    "log-normal, median {}, standard deviation of the logarithm {}",
                    amount(median),
                    amount(deviation)
                )
            }
            Distribution::Triangular { mode } => format!("triangular, mode {}", amount(mode)),
        };
        UncertainReport {
            name: uncertain.name.clone(),
            bounds: uncertain.bounds,
            nominal: tuner.start,
            distribution,
            unit,
        }
    };
    study.uncertain().iter().zip(&study.tuners()[first..]).map(report).collect()
}

/// Returns the table of uncertain parameters for a report.
pub(crate) fn parameters(list: &[UncertainReport]) -> Table {
    let bound = |value: f64| if value.is_finite() { number(value) } else { String::new() };
    let columns = [
        text("uncertain parameter"),
        numbers("nominal"),
        numbers("from"),
        numbers("to"),
        text("unit"),
        text("distribution"),
    ];
    let row = |one: &UncertainReport| -> Vec<Cell> {
        vec![
            one.name.clone().into(),
            number(one.nominal).into(),
            bound(one.bounds[0]).into(),
            bound(one.bounds[1]).into(),
            one.unit.clone().into(),
            one.distribution.clone().into(),
        ]
    };
    Table::new("Uncertain parameters", columns).rows(list.iter().map(row))
}

/// Returns the table of uncertain parameters for the terminal.
pub fn lines_of_parameters(list: &[UncertainReport]) -> Table {
    let columns =
        [text("uncertain"), numbers("nominal"), numbers("min"), numbers("max"), text("unit"), text("distribution")];
    let row = |p: &UncertainReport| -> Vec<Cell> {
        let [low, high] = p.bounds.map(known);
        vec![
            p.name.clone().into(),
            precise(p.nominal).into(),
            low.into(),
            high.into(),
            p.unit.clone().into(),
            p.distribution.clone().into(),
        ]
    };
    Table::new("Uncertain parameters", columns).rows(list.iter().map(row))
}

/// Returns the verdict on a task without findings.
pub(crate) fn interrupted() -> Verdict {
    Verdict::new(Tone::Bad, "No result: the run was interrupted.")
}

mops_outcome::finding!(WorstCaseReport, "worst-case", "Worst cases over a box of uncertain parameters.");

mops_outcome::finding!(MonteCarloReport, "monte-carlo", "Distributions of the criteria.");

mops_outcome::finding!(RobustReport, "robust", "Iterations of a design against worst cases.");

mops_outcome::finding!(
    GlobalSensitivityReport,
    "global-sensitivity",
    "Global sensitivity of the criteria to the uncertain parameters."
);
