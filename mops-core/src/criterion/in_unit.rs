//! Criterion in another unit.

use super::{Criterion, Demand, Mark, Missed, Sense, Tangent, Value};
use crate::case::Case;
use crate::model::Analysis;
use crate::samples::Samples;
use crate::study_error::StudyError;
use crate::unit::Unit;

/// Criterion whose values are in another unit than that of its kind.
pub(crate) struct InUnit {
    inner: Box<dyn Criterion>,
    unit: Unit,
    /// Factor of the values.
    factor: f64,
}

impl InUnit {
    /// Creates the criterion.
    ///
    /// # Errors
    /// If the unit has another dimension, or another zero.
    pub(crate) fn new(inner: Box<dyn Criterion>, unit: &Unit) -> Result<Self, String> {
        let own = inner.unit();
        let factor = own.factor_to(unit).filter(|_| own.is_angle() == unit.is_angle() || !own.dimension().is_none());
        let factor = factor.ok_or_else(|| format!("the values of the criterion are in `{own}`, not in `{unit}`"))?;
        if own.zero() != unit.zero() {
            return Err(format!("the values of the criterion are in `{own}`, whose zero is not that of `{unit}`"));
        }
        Ok(Self { inner, unit: unit.clone(), factor })
    }

    fn converted(&self, value: Value, factor: f64) -> Value {
        let root = factor.abs().sqrt();
        Value {
            number: value.number * factor,
            residuals: value.residuals.iter().map(|r| r * root).collect(),
            missed: value.missed.map(|missed| Missed { horizon: missed.horizon.map(|horizon| horizon * factor) }),
            ..value
        }
    }
}

impl Criterion for InUnit {
    fn unit(&self) -> Unit {
        self.unit.clone()
    }

    fn signals(&self) -> Vec<String> {
        self.inner.signals()
    }

    fn suits(&self, case: &Case) -> Result<(), StudyError> {
        self.inner.suits(case)
    }

    fn value(&self, case: &Case, analysis: &Analysis) -> Result<Value, String> {
        self.inner.value(case, analysis).map(|value| self.converted(value, self.factor))
    }

    fn value_with(&self, case: &Case, analysis: &Analysis, parameters: &[f64]) -> Result<Value, String> {
        self.inner.value_with(case, analysis, parameters).map(|value| self.converted(value, self.factor))
    }

    fn sense(&self) -> Sense {
        self.inner.sense()
    }

    fn range(&self) -> [f64; 2] {
        self.inner.range().map(|bound| bound * self.factor)
    }

    fn assumption(&self) -> Option<String> {
        self.inner.assumption()
    }

    fn natural_demand(&self) -> Option<f64> {
        self.inner.natural_demand().map(|demand| demand * self.factor)
    }

    fn slope(&self, case: &Case, tangent: &Tangent<'_>) -> Result<Value, String> {
        let value = self.converted(tangent.value.clone(), 1.0 / self.factor);
        self.inner.slope(case, &Tangent { value: &value, ..*tangent }).map(|slope| self.converted(slope, self.factor))
    }

    fn samples(&self, case: &Case) -> Option<Samples> {
        let samples = self.inner.samples(case)?;
        let root = self.factor.sqrt();
        Some(Samples { weights: samples.weights.iter().map(|weight| weight * root).collect(), ..samples })
    }

    fn feedback_channel(&self) -> Option<[String; 2]> {
        self.inner.feedback_channel()
    }

    fn marks(&self, demand: &Demand, analysis: &Analysis) -> Vec<Mark> {
        self.inner.marks(&demand.map(|value| value / self.factor), analysis)
    }
}
