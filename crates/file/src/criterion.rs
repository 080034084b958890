//! Criteria of a study file.

use mops_core::catalogue::{Catalogue, schema_once};
use mops_core::criterion::{Other, Usage};
use mops_core::model::{AnalysisKind, Interface};
use mops_core::study::{CriterionBuilder, StudyError};
use mops_language::Diagnostic;

use crate::reading::{kind, read_unit};
use crate::sections::CriterionCommon;
use crate::tree::Node;

pub(crate) fn read_criterion(catalogue: &Catalogue, node: &Node<'_>) -> Result<CriterionBuilder, Diagnostic> {
    let (kind, options) = kind(node, CriterionCommon::KEYS, &catalogue.criteria, |k| k.name, "criterion")?;
    let common: CriterionCommon = node.only(CriterionCommon::KEYS).read()?;
    let criterion = options.read_with(&schema_once(kind.schema), kind.read)?;
    Ok(CriterionBuilder {
        criterion: Box::new(Located { inner: criterion, kind: kind.name }),
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

/// A criterion of a study file; its errors are located under the name of its kind.
pub(crate) struct Located {
    inner: Box<dyn mops_core::criterion::CriterionSpec>,
    kind: &'static str,
}

impl mops_core::criterion::CriterionSpec for Located {
    fn reads(&self) -> AnalysisKind {
        self.inner.reads()
    }

    fn bind(&self, model: &Interface) -> Result<Box<dyn mops_core::criterion::Criterion>, StudyError> {
        self.inner.bind(model).map_err(|mistake| mistake.within(self.kind))
    }

    fn needs_measurement(&self) -> Option<&str> {
        self.inner.needs_measurement()
    }

    fn names(&self) -> Vec<String> {
        self.inner.names()
    }

    fn bind_within(
        &self,
        model: &Interface,
        others: &[Other],
        window: [f64; 2],
    ) -> Result<Box<dyn mops_core::criterion::Criterion>, StudyError> {
        self.inner.bind_within(model, others, window).map_err(|mistake| mistake.within(self.kind))
    }

    fn reads_any(&self) -> bool {
        self.inner.reads_any()
    }

    fn bind_with(
        &self,
        model: &Interface,
        others: &[Other],
    ) -> Result<Box<dyn mops_core::criterion::Criterion>, StudyError> {
        self.inner.bind_with(model, others).map_err(|mistake| mistake.within(self.kind))
    }
}
