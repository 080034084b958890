//! The table of uncertain parameters in a study file: `[uncertain]`.

use mops_core::study::{DistributionBuilder, StudyBuilder, UncertainBuilder};
use mops_language::{Diagnostic, Quantity, entries::Entries};
use schemars::JsonSchema;

use super::tree::Node;

/// Name of the table, which tasks share.
pub(super) const TABLE: &str = "uncertain";

/// An uncertain parameter of models, or an uncertain tuner. Without a distribution its values are uniform between `min`
/// and `max`; with one, the distribution is truncated at the bounds.
#[derive(Debug, Default, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct UncertainSection {
    /// Smallest value.
    pub min: Option<Quantity>,
    /// Largest value.
    pub max: Option<Quantity>,
    /// Largest relative deviation of a tuner from its design value, in both directions, instead of `min` and `max`;
    /// 0.05 is 5 %.
    pub tolerance: Option<f64>,
    /// Normal distribution: `{ mean = 1.0, deviation = 0.1 }`, or `{ interval = [0.8, 1.2] }` with the central interval
    /// that contains 95 % of the values.
    pub normal: Option<NormalTable>,
    /// Log-normal distribution: `{ median = 1.0, deviation = 0.1 }`, or `{ interval = [0.8, 1.25] }` with the central
    /// interval that contains 95 % of the values. `deviation` is the standard deviation of the natural logarithm.
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

/// Reads the table into the draft; an absent table leaves it as it is.
pub(super) fn read(root: &Node<'_>, draft: &mut StudyBuilder) -> Result<(), Diagnostic> {
    for (name, node) in root.table("uncertain")? {
        draft.uncertain.retain(|(known, _)| *known != name);
        draft.uncertain.push((name, uncertain(&node)?));
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
