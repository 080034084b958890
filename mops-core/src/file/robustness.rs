//! The tables of uncertain parameters in a study file, and of the tasks over them: `[uncertain]`, `[worst-case]`,
//! `[monte-carlo]`, `[robust]`; and `[uncertainty]`, of the estimates of a calibration.

use schemars::JsonSchema;

use super::Diagnostic;
use super::entries::Entries;
use super::tree::Node;
use crate::statistics::Sampling;
use crate::study::{
    Chosen, DistributionDraft, MonteCarloTask, Place, RobustTask, TasksDraft, UncertainDraft, UncertaintyTask,
    WorstCaseTask,
};
use crate::unit::Quantity;

/// A parameter of models, or a tuner, that is not known exactly. Without a distribution its values lie evenly between `min`
/// and `max`; with one, the bounds cut off what lies outside.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct UncertainSection {
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
    /// Of a tuner: the share of the design's value by which it may be off, either way, instead of `min` and `max`; 0.05 is
    /// 5 %.
    pub tolerance: Option<f64>,
    /// `{ mean = 1.0, deviation = 0.1 }`, or `{ interval = [0.8, 1.2] }`: 95 % of the values lie in it.
    pub normal: Option<NormalTable>,
    /// `{ median = 1.0, deviation = 0.1 }`, the deviation being that of the natural logarithm, or
    /// `{ interval = [0.8, 1.25] }`: 95 % of the values lie in it.
    pub log_normal: Option<LogNormalTable>,
    /// `{ mode = 1.0 }`: a triangle from `min` over the mode to `max`.
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
    /// Two values between which 95 % of all lie, instead of mean and deviation.
    pub interval: Option<[Quantity; 2]>,
}

/// A distribution whose logarithm is normal.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct LogNormalTable {
    /// Median.
    pub median: Option<Quantity>,
    /// Standard deviation of the natural logarithm; 0.1 is about 10 %.
    pub deviation: Option<f64>,
    /// Two values between which 95 % of all lie, instead of median and deviation.
    pub interval: Option<[Quantity; 2]>,
}

/// A triangular distribution.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct TriangularTable {
    /// Most probable value.
    pub mode: Quantity,
}

/// How `task = "worst-case"` searches the box of [uncertain] for the largest scaled value of every criterion.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct WorstCaseSection {
    /// The design that is looked at: `optimum` (the default: the study is solved first) or `start`.
    #[serde(default)]
    pub at: Place,
    /// Criteria whose worst is sought; all that count where absent.
    pub criteria: Option<Vec<String>>,
    /// Points at which every criterion is looked at first, besides the corners of the box; 128 where absent.
    pub samples: Option<usize>,
    /// Local searches for every criterion, from the worst of these points; 8 where absent. One more, over the whole box,
    /// comes on top.
    pub starts: Option<usize>,
}

/// Makes a design hold over the whole box of [uncertain], as far as its worst cases are found: solve for the cases at hand,
/// search the worst ones, add them, and so on.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct RobustSection {
    /// Rounds, at most; 12 where absent.
    pub rounds: Option<usize>,
    /// What a worst case may exceed the design's own worst by, in scaled values, without being added; 0.001 where absent.
    pub tolerance: Option<f64>,
    /// As in [worst-case]; 128 where absent.
    pub samples: Option<usize>,
    /// As in [worst-case]; 4 where absent.
    pub starts: Option<usize>,
}

/// How `task = "monte-carlo"` draws the parameters of [uncertain], and what it tells of the criteria.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct MonteCarloSection {
    /// The design that is looked at: `optimum` (the default: the study is solved first) or `start`.
    #[serde(default)]
    pub at: Place,
    /// Number of samples; 1000 where absent.
    pub samples: Option<usize>,
    /// How they are drawn: `random` (the default), `latin-hypercube`, or `sobol` (a scrambled sequence).
    #[serde(default)]
    pub method: Sampling,
    /// Shares of the values whose bounds are told; [0.05, 0.5, 0.95] where absent.
    pub quantiles: Option<Vec<f64>>,
    /// Confidence of the intervals; 0.95 where absent.
    pub level: Option<f64>,
}

/// What a calibration tells of its estimates besides standard errors.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct UncertaintySection {
    /// Profiles of the likelihood: `true` for every tuner, or a list of tuners.
    pub profile: Option<AllOrSome>,
    /// Number of bootstrap replicates: residuals are drawn anew in blocks and everything is estimated again. None where
    /// absent; 200 do for standard errors, 1000 for intervals.
    pub bootstrap: Option<usize>,
    /// Length of a block in samples; the cube root of their number, rounded up, where absent.
    pub block: Option<usize>,
    /// `true` draws bands around the predictions of the calibrated model.
    #[serde(default)]
    pub bands: bool,
    /// Confidence of all intervals; 0.95 where absent.
    pub level: Option<f64>,
}

/// All of them, or a list.
#[derive(Debug, serde::Deserialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum AllOrSome {
    /// All or none.
    All(bool),
    /// These.
    Some(Vec<String>),
}

/// Reads the tables; what is absent has its defaults.
pub(super) fn read(root: &Node<'_>, tasks: &mut TasksDraft) -> Result<(), Diagnostic> {
    for (name, node) in root.table("uncertain")? {
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

fn uncertain(node: &Node<'_>) -> Result<UncertainDraft, Diagnostic> {
    let UncertainSection { min, max, tolerance, normal, log_normal, triangular } = node.read()?;
    let named = [normal.is_some(), log_normal.is_some(), triangular.is_some()].iter().filter(|&&is| is).count();
    if named > 1 {
        return Err(node
            .key_diagnostic("a parameter has one distribution, but two are named".to_owned())
            .with_help("remove one"));
    }
    let incomplete = |key: &str, way_out: &str| {
        let place = node.child(key).expect("it was read");
        Err(place.diagnostic(format!("the {key} distribution is not complete, or said twice")).with_help(way_out))
    };
    let distribution = match (normal, log_normal, triangular) {
        (Some(NormalTable { mean: Some(mean), deviation: Some(deviation), interval: None }), ..) => {
            Some(DistributionDraft::Normal { mean, deviation })
        }
        (Some(NormalTable { mean: None, deviation: None, interval: Some(interval) }), ..) => {
            Some(DistributionDraft::NormalWithin(interval))
        }
        (Some(_), ..) => return incomplete("normal", "give either `mean` and `deviation`, or `interval`"),
        (_, Some(LogNormalTable { median: Some(median), deviation: Some(deviation), interval: None }), _) => {
            Some(DistributionDraft::LogNormal { median, deviation })
        }
        (_, Some(LogNormalTable { median: None, deviation: None, interval: Some(interval) }), _) => {
            Some(DistributionDraft::LogNormalWithin(interval))
        }
        (_, Some(_), _) => return incomplete("log-normal", "give either `median` and `deviation`, or `interval`"),
        (_, _, Some(TriangularTable { mode })) => Some(DistributionDraft::Triangular { mode }),
        (None, None, None) => None,
    };
    Ok(UncertainDraft { min, max, tolerance, distribution })
}

/// All uncertain parameters, for the schema.
pub(super) type UncertainTable = Entries<UncertainSection>;
