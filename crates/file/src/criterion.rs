//! Criteria of a study file.

use mops_core::catalogue::{Catalogue, schema_once};
use mops_core::criterion::Usage;
use mops_core::study::CriterionBuilder;
use mops_language::Diagnostic;

use crate::reading::{kind, read_unit};
use crate::sections::CriterionCommon;
use crate::tree::Node;

pub(crate) fn read_criterion(catalogue: &Catalogue, node: &Node<'_>) -> Result<CriterionBuilder, Diagnostic> {
    let (kind, options) = kind(node, CriterionCommon::KEYS, &catalogue.criteria, |k| k.name, "criterion")?;
    let common: CriterionCommon = node.only(CriterionCommon::KEYS).read()?;
    Ok(CriterionBuilder {
        criterion: options.read_with(&schema_once(kind.schema), kind.read)?,
        kind: Some(kind.name),
        model: common.model,
        cases: common.cases,
        usage: common.usage.unwrap_or(Usage::Minimise),
        demand: common.demand,
        good: common.good,
        bad: common.bad,
        weight: common.weight.unwrap_or(1.0),
        from: common.from,
        until: common.until,
        unit: common.unit.as_deref().map(|unit| read_unit(node, "unit", unit)).transpose()?,
    })
}
