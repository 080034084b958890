//! Tables of uncertain parameters in a study file, and of the tasks over them: `[uncertain]`, `[worst-case]`, `[monte-carlo]`
//! and `[robust]`. `[uncertainty]` is for the estimates of a calibration.

use mops_core::study::{
    Chosen, DistributionBuilder, MonteCarloTask, Place, RobustTask, TasksBuilder, UncertainBuilder, UncertaintyTask,
    WorstCaseTask,
};
use mops_language::Quantity;
use mops_statistics::Sampling;
use schemars::JsonSchema;

use super::Diagnostic;
use super::entries::Entries;
use super::tree::Node;

/// An uncertain parameter of models, or an uncertain tuner. Without a distribution its values are uniform between `min` and
/// `max`; with one, the distribution is truncated at the bounds.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct UncertainSection {
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
    /// Largest relative deviation of a tuner from its design value, in both directions, instead of `min` and `max`; 0.05 is
    /// 5 %.
    pub tolerance: Option<f64>,
    /// Normal distribution: `{ mean = 1.0, deviation = 0.1 }`, or `{ interval = [0.8, 1.2] }` with the central interval that
    /// contains 95 % of the values.
    pub normal: Option<NormalTable>,
    /// Log-normal distribution: `{ median = 1.0, deviation = 0.1 }`, or `{ interval = [0.8, 1.25] }` with the central interval
    /// that contains 95 % of the values. `deviation` is the standard deviation of the natural logarithm.
    pub log_normal: Option<LogNormalTable>,
    /// Triangular distribution between `min` and `max`: `{ mode = 1.0 }` is its peak.
    pub triangular: Option<TriangularTable>,
}

/// A normal distribution.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct NormalTable {
    /// Mean.
    pub mean: Option<Quantity>,
    /// Standard deviation.
    pub deviation: Option<Quantity>,
    /// Interval that contains 95 % of the values, instead of mean and deviation.
    pub interval: Option<[Quantity; 2]>,
}

/// A log-normal distribution.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct LogNormalTable {
    /// Median.
    pub median: Option<Quantity>,
    /// Standard deviation of the natural logarithm; 0.1 is about 10 %.
    pub deviation: Option<f64>,
    /// Interval that contains 95 % of the values, instead of median and deviation.
    pub interval: Option<[Quantity; 2]>,
}

/// A triangular distribution.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct TriangularTable {
    /// Most probable value.
    pub mode: Quantity,
}

/// Settings of `task = "worst-case"`: the search of the box of [uncertain] for the largest scaled value of every criterion.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct WorstCaseSection {
    /// Design to be examined: `optimum` (default: the study is solved first) or `start`.
    #[serde(default)]
    pub at: Place,
    /// Criteria for the worst-case search; default is every criterion that counts.
    pub criteria: Option<Vec<String>>,
    /// Number of initial sample points per criterion, in addition to the corners of the box; default 128.
    pub samples: Option<usize>,
    /// Number of local searches per criterion, from the worst sample points; default 8. One more search covers the whole
    /// box.
    pub starts: Option<usize>,
}

/// Settings of a design against the worst cases in the box of [uncertain], as far as the search finds them. The design is
/// solved for the present cases, the worst cases are searched and added, and the procedure is repeated.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct RobustSection {
    /// Maximum number of iterations; default 12.
    pub rounds: Option<usize>,
    /// Tolerance in scaled values; default 0.001. A worst case is added only if it exceeds the present worst scaled value by
    /// more.
    pub tolerance: Option<f64>,
    /// Number of initial sample points, as in [worst-case]; default 128.
    pub samples: Option<usize>,
    /// Number of local searches, as in [worst-case]; default 4.
    pub starts: Option<usize>,
}

/// Settings of `task = "monte-carlo"`: sampling of the parameters of [uncertain], and reported statistics.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct MonteCarloSection {
    /// Design to be examined: `optimum` (default: the study is solved first) or `start`.
    #[serde(default)]
    pub at: Place,
    /// Number of samples; default 1000.
    pub samples: Option<usize>,
    /// Sampling method: `random` (default), `latin-hypercube`, or `sobol` (a scrambled sequence).
    #[serde(default)]
    pub method: Sampling,
    /// Levels of the reported quantiles; default [0.05, 0.5, 0.95].
    pub quantiles: Option<Vec<f64>>,
    /// Confidence level of the intervals; default 0.95.
    pub level: Option<f64>,
}

/// Settings of the uncertainty of a calibration's estimates, in addition to standard errors.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct UncertaintySection {
    /// Likelihood profiles: `true` for every tuner, or a list of tuners.
    pub profile: Option<AllOrSome>,
    /// Number of bootstrap replicates, with residuals resampled in blocks; default none. 200 are sufficient for standard
    /// errors, 1000 for intervals.
    pub bootstrap: Option<usize>,
    /// Block length in samples; default is the cube root of the number of samples, rounded up.
    pub block: Option<usize>,
    /// `true` computes confidence bands of the predictions of the calibrated model.
    #[serde(default)]
    pub bands: bool,
    /// Confidence level of all intervals; default 0.95.
    pub level: Option<f64>,
}

/// All names, none, or a list.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum AllOrSome {
    /// All or none.
    All(bool),
    /// Listed names.
    Some(Vec<String>),
}

/// Reads the tables into `tasks`; absent tables leave it as it is.
pub(super) fn read(root: &Node<'_>, tasks: &mut TasksBuilder) -> Result<(), Diagnostic> {
    for (name, node) in root.table("uncertain")? {
        tasks.uncertain.retain(|(known, _)| *known != name);
        tasks.uncertain.push((name, uncertain(&node)?));
    }
    if let Some(node) = root.child("worst-case") {
        let usual = WorstCaseTask::default();
        let WorstCaseSection { at, criteria, samples, starts } = node.read()?;
        let (samples, starts) = (samples.unwrap_or(usual.samples), starts.unwrap_or(usual.starts));
        tasks.worst_case = WorstCaseTask { at, criteria, samples, starts };
    }
    if let Some(node) = root.child("robust") {
        let usual = RobustTask::default();
        let section: RobustSection = node.read()?;
        tasks.robust = Some(RobustTask {
            rounds: section.rounds.unwrap_or(usual.rounds),
            tolerance: section.tolerance.unwrap_or(usual.tolerance),
            samples: section.samples.unwrap_or(usual.samples),
            starts: section.starts.unwrap_or(usual.starts),
        });
    }
    if let Some(node) = root.child("monte-carlo") {
        let usual = MonteCarloTask::default();
        let section: MonteCarloSection = node.read()?;
        tasks.monte_carlo = MonteCarloTask {
            at: section.at,
            samples: section.samples.unwrap_or(usual.samples),
            method: section.method,
            quantiles: section.quantiles.unwrap_or(usual.quantiles),
            level: section.level.unwrap_or(usual.level),
        };
    }
    if let Some(node) = root.child("uncertainty") {
        let usual = UncertaintyTask::default();
        let section: UncertaintySection = node.read()?;
        tasks.uncertainty = Some(UncertaintyTask {
            profile: match section.profile {
                None | Some(AllOrSome::All(false)) => Chosen::None,
                Some(AllOrSome::All(true)) => Chosen::All,
                Some(AllOrSome::Some(names)) => Chosen::Some(names),
            },
            bootstrap: section.bootstrap.unwrap_or(usual.bootstrap),
            block: section.block,
            bands: section.bands,
            level: section.level.unwrap_or(usual.level),
        });
    }
    Ok(())
}

fn uncertain(node: &Node<'_>) -> Result<UncertainBuilder, Diagnostic> {
    let UncertainSection { min, max, tolerance, normal, log_normal, triangular } = node.read()?;
    let named = [normal.is_some(), log_normal.is_some(), triangular.is_some()].iter().filter(|&&is| is).count();
    if named > 1 {
        return Err(node
            .key_diagnostic("expected one distribution, found several".to_owned())
            .with_help("keep one of them"));
    }
    let incomplete = |key: &str, way_out: &str| {
        let place = node.child(key).expect("it was read");
        Err(place.diagnostic(format!("the {key} distribution is incomplete or overdetermined")).with_help(way_out))
    };
    let distribution = match (normal, log_normal, triangular) {
        (Some(NormalTable { mean: Some(mean), deviation: Some(deviation), interval: None }), ..) => {
            Some(DistributionBuilder::Normal { mean, deviation })
        }
        (Some(NormalTable { mean: None, deviation: None, interval: Some(interval) }), ..) => {
            Some(DistributionBuilder::NormalWithin(interval))
        }
        (Some(_), ..) => return incomplete("normal", "give either `mean` and `deviation`, or `interval`"),
        (_, Some(LogNormalTable { median: Some(median), deviation: Some(deviation), interval: None }), _) => {
            Some(DistributionBuilder::LogNormal { median, deviation })
        }
        (_, Some(LogNormalTable { median: None, deviation: None, interval: Some(interval) }), _) => {
            Some(DistributionBuilder::LogNormalWithin(interval))
        }
        (_, Some(_), _) => return incomplete("log-normal", "give either `median` and `deviation`, or `interval`"),
        (_, _, Some(TriangularTable { mode })) => Some(DistributionBuilder::Triangular { mode }),
        (None, None, None) => None,
    };
    Ok(UncertainBuilder { min, max, tolerance, distribution })
}

/// Table of all uncertain parameters, for the schema.
pub(super) type UncertainTable = Entries<UncertainSection>;
