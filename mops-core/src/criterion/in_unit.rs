//! Criterion in another unit.

use mops_language::Unit;

use super::{Criterion, Demand, Mark, Missed, Sense, Tangent, Value};
use crate::case::Case;
use crate::criterion::Samples;
use crate::error::StudyError;
use crate::model::Analysis;

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
    /// If the unit has another dimension, or another zero, or is ambiguous.
    pub(crate) fn new(inner: Box<dyn Criterion>, unit: &Unit) -> Result<Self, String> {
        let own = inner.unit();
        let factor = own.factor_to(unit).filter(|_| own.is_angle() == unit.is_angle() || !own.dimension().is_none());
        let factor = factor.ok_or_else(|| format!("the values of the criterion are in `{own}`, not in `{unit}`"))?;
        if own.zero() != unit.zero() {
            return Err(format!("the values of the criterion are in `{own}`, whose zero is not that of `{unit}`"));
        }
        match unit.ambiguity_in(&own) {
            Some(why) => Err(why),
            None => Ok(Self { inner, unit: unit.clone().of_quantity_in(&own), factor }),
        }
    }

    /// Returns the factor of the number of a value: 1 for a missed criterion that is not a time, whose number is a
    /// ratio.
    fn factor_of(&self, value: &Value) -> f64 {
        if value.missed == Some(Missed { horizon: None }) { 1.0 } else { self.factor }
    }

    fn converted(&self, value: Value) -> Value {
        let factor = self.factor_of(&value);
        multiplied(value, factor)
    }
}

/// Returns the value in another unit.
fn multiplied(value: Value, factor: f64) -> Value {
    let root = factor.abs().sqrt();
    Value {
        number: value.number * factor,
        residuals: value.residuals.iter().map(|r| r * root).collect(),
        missed: value.missed.map(|missed| Missed { horizon: missed.horizon.map(|horizon| horizon * factor) }),
        ..value
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
        self.inner.value(case, analysis).map(|value| self.converted(value))
    }

    fn value_with(&self, case: &Case, analysis: &Analysis, parameters: &[f64]) -> Result<Value, String> {
        self.inner.value_with(case, analysis, parameters).map(|value| self.converted(value))
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
        let factor = self.factor_of(tangent.value);
        let value = multiplied(tangent.value.clone(), 1.0 / factor);
        self.inner.slope(case, &Tangent { value: &value, ..*tangent }).map(|slope| multiplied(slope, factor))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Response;

    /// A criterion in rad/s that is never reached.
    struct Never;

    impl Criterion for Never {
        fn unit(&self) -> Unit {
            Unit::known("rad/s")
        }

        fn signals(&self) -> Vec<String> {
            Vec::new()
        }

        fn value(&self, _: &Case, _: &Analysis) -> Result<Value, String> {
            Ok(Value::missed(None, 0.5, 0.5, "never"))
        }
    }

    #[test]
    fn a_criterion_that_is_not_reached_meets_no_demand_in_any_unit() {
        let analysis = Analysis::Time(Response::default());
        let own = Never.value(&Case::default(), &analysis).unwrap();
        for unit in ["Hz", "MHz", "rpm", "1/min", "1/h", "deg/s"] {
            let shown = InUnit::new(Box::new(Never), &Unit::known(unit)).unwrap();
            let value = shown.value(&Case::default(), &analysis).unwrap();
            assert_eq!((value.number, value.missed), (own.number, own.missed), "{unit}");
            for demand in [Demand::AtMost(3.0), Demand::AtLeast(3.0), Demand::Pair { good: 5.0, bad: 3.0 }] {
                assert_eq!(demand.scaled(&value).value, 1.5, "{unit}");
            }
        }
    }
}
