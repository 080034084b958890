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

/// Creates a criterion from a closure. The closure receives the time responses of `signals`, in this order, and returns the
/// value in `unit`; a value that is not finite makes the point fail.
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

#[cfg(test)]
mod tests {
    use super::*;
    use mops_core::Response;

    /// `a = t` from 0 to 3 s.
    fn ramp() -> Analysis {
        let mut a = Trace::starting_at(0.0, 1);
        a.push(3.0, Trace::NODES.map(|s| 3.0 * s));
        Analysis::Time(Response { traces: vec![("a".into(), a)], ..Response::default() })
    }

    #[test]
    fn the_closure_sees_the_signals_and_gives_the_value() {
        let mean = from_fn(["a"], Unit::known("m"), |traces| traces[0].integral(|_, a| a) / 3.0);
        let criterion = mean.bind(&Interface::default()).unwrap();
        assert_eq!((criterion.signals(), criterion.unit()), (vec!["a".to_owned()], Unit::known("m")));
        assert!((criterion.value(&Case::default(), &ramp()).unwrap().number - 1.5).abs() < 1e-14);
    }

    #[test]
    fn a_value_that_is_not_finite_is_a_failure() {
        let nowhere = from_fn(["a"], Unit::one(), |_| f64::NAN).bind(&Interface::default()).unwrap();
        assert!(nowhere.value(&Case::default(), &ramp()).unwrap_err().contains("NaN"));
    }
}
