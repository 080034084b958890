//! Tests of criteria from closures.

use mops_core::{Analysis, Case, CriterionSpec, Interface, Response, Trace};
use mops_criteria::from_fn;
use mops_language::Unit;

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
