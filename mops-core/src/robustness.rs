//! What is found where parameters are uncertain, as it stands in `result.json`: worst cases, distributions, effects.

use serde::Serialize;

use crate::criterion::Usage;
use crate::statistics::Sampling;
use crate::study::{Distribution, Row, Study};

/// An uncertain parameter of a result.
#[derive(Debug, Clone, Serialize)]
pub struct UncertainReport {
    /// Name.
    pub name: String,
    /// Smallest and largest value; null where there is none.
    pub bounds: [f64; 2],
    /// Value without uncertainty.
    pub nominal: f64,
    /// How its values are distributed, in words.
    pub distribution: String,
    /// Unit of all of these.
    pub unit: String,
}

/// The criterion that something was found of.
#[derive(Debug, Clone, Serialize)]
pub struct Subject {
    /// Name.
    pub criterion: String,
    /// The model it reads.
    pub model: String,
    /// The case; the uncertain parameters have other values than there.
    pub case: String,
    /// What the study does with it.
    pub usage: Usage,
    /// The value that scales to 1; null where nothing was asked.
    pub demand: Option<f64>,
    /// Unit of its values.
    pub unit: String,
    /// Its value without uncertainty.
    pub nominal: f64,
}

/// The worst cases over a box.
#[derive(Debug, Clone, Serialize)]
pub struct WorstCaseReport {
    /// The findings in sentences; names stand between backticks.
    pub words: Vec<String>,
    /// What is uncertain.
    pub parameters: Vec<UncertainReport>,
    /// The worst of every criterion.
    pub criteria: Vec<WorstReport>,
    /// Simulations that the searches took.
    pub simulations: usize,
    /// Whether it is shown that nothing in the box is worse: it never is.
    pub guaranteed: bool,
}

/// The worst that was found of a criterion.
#[derive(Debug, Clone, Serialize)]
pub struct WorstReport {
    /// The criterion.
    #[serde(flatten)]
    pub of: Subject,
    /// Its worst value that was found; null where every simulation failed.
    pub value: f64,
    /// By its demand; null where nothing was asked.
    pub scaled: f64,
    /// Whether its demand is met even there; true where there is none.
    pub met: bool,
    /// Where that is.
    pub at: Vec<CoordinateReport>,
    /// Searches.
    pub starts: usize,
    /// Searches that ended there.
    pub ended_here: usize,
    /// Simulations that the searches took, those shared by all criteria not counted.
    pub simulations: usize,
    /// Simulations among them, and among the shared ones, that failed: there the criterion has no value.
    pub failed: usize,
    /// The first of these failures, and where it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<FailedAt>,
    /// The value along each parameter through the worst case.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub slices: Vec<Slice>,
}

/// A simulation that failed.
#[derive(Debug, Clone, Serialize)]
pub struct FailedAt {
    /// Why, in words.
    pub why: String,
    /// Where.
    pub at: Vec<CoordinateReport>,
}

/// The value of an uncertain parameter at a point.
#[derive(Debug, Clone, Serialize)]
pub struct CoordinateReport {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// `lower` or `upper` where it is at that end of its range.
    pub at_bound: Option<&'static str>,
}

/// A criterion along one parameter, the others held.
#[derive(Debug, Clone, Serialize)]
pub struct Slice {
    /// Name of the parameter.
    pub parameter: String,
    /// Unit of its values.
    pub unit: String,
    /// Its values.
    pub x: Vec<f64>,
    /// Those of the criterion; null where the simulation failed.
    pub y: Vec<f64>,
}

/// How criteria are distributed where parameters are uncertain.
#[derive(Debug, Clone, Serialize)]
pub struct MonteCarloReport {
    /// The findings in sentences; names stand between backticks.
    pub words: Vec<String>,
    /// What is uncertain.
    pub parameters: Vec<UncertainReport>,
    /// Number of samples.
    pub samples: usize,
    /// How they were drawn.
    pub method: Sampling,
    /// Confidence of all intervals; exact for samples drawn at random.
    pub level: f64,
    /// Samples in which a simulation or a criterion failed.
    pub failed: usize,
    /// Every criterion.
    pub criteria: Vec<DistributionReport>,
    /// Samples that meet every demand at once; null where nothing is demanded.
    pub all: Option<ShareReport>,
    /// The samples: values of the uncertain parameters, then of the criteria. They are written as `samples.csv`.
    #[serde(skip)]
    pub table: Vec<(Vec<f64>, Vec<f64>)>,
}

/// How a criterion is distributed.
#[derive(Debug, Clone, Serialize)]
pub struct DistributionReport {
    /// The criterion.
    #[serde(flatten)]
    pub of: Subject,
    /// Mean of the samples that have a value.
    pub mean: f64,
    /// Their standard deviation.
    pub deviation: f64,
    /// The smallest.
    pub min: f64,
    /// The largest.
    pub max: f64,
    /// Quantiles.
    pub quantiles: Vec<QuantileReport>,
    /// Samples that meet the demand; one that failed does not. Null where there is none.
    pub met: Option<ShareReport>,
    /// Samples without a value.
    pub failed: usize,
}

/// A quantile with its confidence interval, which supposes no distribution.
#[derive(Debug, Clone, Serialize)]
pub struct QuantileReport {
    /// Share of the values that do not exceed it.
    pub share: f64,
    /// The quantile.
    pub value: f64,
    /// Its interval; an end is null where the samples are too few for one.
    pub interval: [f64; 2],
}

/// A share of samples with its confidence interval (Clopper-Pearson).
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ShareReport {
    /// Samples that count.
    pub count: usize,
    /// All samples.
    pub of: usize,
    /// Their share.
    pub share: f64,
    /// Its interval.
    pub interval: [f64; 2],
}

/// How a design against worst cases was found.
#[derive(Debug, Clone, Serialize)]
pub struct RobustReport {
    /// The findings in sentences; names stand between backticks.
    pub words: Vec<String>,
    /// What is uncertain.
    pub parameters: Vec<UncertainReport>,
    /// Every round: a design for the cases at hand, and the worst cases found for it.
    pub rounds: Vec<RoundReport>,
    /// The round whose design is reported: that with the best worst case.
    pub chosen: usize,
    /// Whether the last search found nothing worse than the cases at hand by more than the tolerance.
    pub settled: bool,
    /// The tolerance, in scaled values.
    pub tolerance: f64,
    /// The worst of every criterion for the reported design.
    pub criteria: Vec<WorstReport>,
    /// Whether it is shown that nothing in the box is worse: it never is.
    pub guaranteed: bool,
}

/// A round of a design against worst cases.
#[derive(Debug, Clone, Serialize)]
pub struct RoundReport {
    /// Number of cases that the design was made for.
    pub cases: usize,
    /// The design: values of all tuners.
    pub tuners: Vec<f64>,
    /// Worst weighted scaled value over these cases.
    pub for_cases: f64,
    /// Largest violation of a constraint over these cases, in scaled values.
    pub violation_for_cases: f64,
    /// Worst weighted scaled value that was found in the box.
    pub found: f64,
    /// Largest violation of a constraint that was found in the box.
    pub violation_found: f64,
    /// Points evaluated to make the design.
    pub evaluations: usize,
    /// Simulations of the searches for worst cases.
    pub simulations: usize,
    /// The cases that were added.
    pub added: Vec<AddedReport>,
}

/// A case that was added.
#[derive(Debug, Clone, Serialize)]
pub struct AddedReport {
    /// Its name.
    pub name: String,
    /// The criterion for which it is a worst case.
    pub criterion: String,
    /// Its scaled value there.
    pub scaled: f64,
    /// The values of the uncertain parameters.
    pub at: Vec<CoordinateReport>,
}

/// Effects of the uncertain parameters over their whole ranges.
#[derive(Debug, Clone, Serialize)]
pub struct GlobalSensitivityReport {
    /// The findings in sentences; names stand between backticks.
    pub words: Vec<String>,
    /// `morris` or `sobol`.
    pub method: crate::study::SensitivityMethod,
    /// What is uncertain.
    pub parameters: Vec<UncertainReport>,
    /// Trajectories, or samples.
    pub samples: usize,
    /// Those of them that were left out because a simulation failed.
    pub failed: usize,
    /// Simulations.
    pub simulations: usize,
    /// Confidence of the intervals.
    pub level: f64,
    /// Every criterion.
    pub criteria: Vec<EffectsReport>,
}

/// Effects of the uncertain parameters on a criterion.
#[derive(Debug, Clone, Serialize)]
pub struct EffectsReport {
    /// The criterion.
    #[serde(flatten)]
    pub of: Subject,
    /// Every parameter; empty where the criterion does not vary.
    pub effects: Vec<EffectReport>,
}

/// Effect of an uncertain parameter: `morris` fills the first three, `sobol` the others.
#[derive(Debug, Clone, Serialize)]
pub struct EffectReport {
    /// The parameter.
    pub parameter: String,
    /// Mean of its elementary effects, per range of the parameter, in the criterion's unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean: Option<f64>,
    /// Mean of their magnitudes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnitude: Option<f64>,
    /// Their standard deviation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviation: Option<f64>,
    /// Share of the variance by the parameter alone, and its interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first: Option<Estimated>,
    /// Share of the variance by the parameter alone and together with others, and its interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub total: Option<Estimated>,
}

/// A number that is known within an interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimated {
    /// The estimate.
    pub value: f64,
    /// Its interval.
    pub interval: [f64; 2],
}

impl Subject {
    /// A row of a study, with its value without uncertainty.
    pub fn of(study: &Study, row: &Row, nominal: f64) -> Self {
        let plan = &study.jobs[row.job];
        Self {
            criterion: row.name.clone(),
            model: study.models[plan.model].0.clone(),
            case: study.cases[plan.case].name.clone(),
            usage: row.usage,
            demand: row.demand.limit(),
            unit: row.unit.to_string(),
            nominal,
        }
    }
}

/// The uncertain parameters of a study that was made by [`Study::over_uncertain`].
pub fn uncertain_reports(study: &Study) -> Vec<UncertainReport> {
    let first = study.tuners.len() - study.tasks.uncertain.len();
    let report = |(uncertain, tuner): (&crate::study::Uncertain, &crate::tuner::Tuner)| {
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
    study.tasks.uncertain.iter().zip(&study.tuners[first..]).map(report).collect()
}
