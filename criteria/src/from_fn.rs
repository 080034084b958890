//! Criteria from closures.

use std::sync::Arc;

use mops_core::{Analysis, Case, Criterion, CriterionSpec, Interface, StudyError, Trace, Value};
use mops_language::Unit;

/// Value of the time responses.
type ValueFn = Arc<dyn Fn(&[&Trace]) -> f64 + Send + Sync>;

/// Criterion given by a closure over time responses; see [`from_fn`].
#[derive(Clone)]
pub struct FnCriterion {
    unit: Unit,
    signals: Vec<String>,
    value: ValueFn,
}

/// Creates a criterion from a closure. The closure receives the time responses of `signals`, in this order, and returns
/// the value in `unit`; a value that is not finite makes the point fail.
///
/// ```
/// use mops_core::study::CriterionBuilder;
/// use mops_language::Unit;
///
/// // Root mean square of the signal `a`.
/// let shaking = mops_criteria::from_fn(["a"], Unit::known("m/s2"), |traces| {
///     let a = traces[0];
///     (a.integral(|_, a| a * a) / (a.end() - a.start())).sqrt()
/// });
/// let criterion = CriterionBuilder::minimise(shaking, 2.0);
/// ```
pub fn from_fn<const N: usize>(
    signals: [&str; N],
    unit: Unit,
    value: impl Fn(&[&Trace]) -> f64 + Send + Sync + 'static,
) -> FnCriterion {
    FnCriterion { unit, signals: signals.map(str::to_owned).to_vec(), value: Arc::new(value) }
}

impl CriterionSpec for FnCriterion {
    fn bind(&self, _: &Interface) -> Result<Box<dyn Criterion>, StudyError> {
        Ok(Box::new(self.clone()))
    }
}

impl Criterion for FnCriterion {
    fn unit(&self) -> Unit {
        self.unit.clone()
    }

    fn signals(&self) -> Vec<String> {
        self.signals.clone()
    }

    fn value(&self, _: &Case, analysis: &Analysis) -> Result<Value, String> {
        let traces: Vec<&Trace> = self.signals.iter().map(|signal| analysis.trace(signal)).collect();
        match (self.value)(&traces) {
            value if value.is_finite() => Ok(value.into()),
            value => Err(format!("the closure of the criterion returned {value}")),
        }
    }
}
