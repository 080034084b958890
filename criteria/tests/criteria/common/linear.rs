//! Tests of the common parts of criteria of linear systems: channel, value type, criterion.

use mops_core::{Case, CriterionSpec, StudyError};
use mops_criteria::phase_margin::PhaseMargin;

use crate::testing::{assert_near, channel, linear};

#[test]
fn a_loop_is_closed_in_one_dimension_and_counted_in_one_unit() {
    let margin = |from: &str, to: &str, gain: f64| {
        let criterion = PhaseMargin::default().bind(&channel(from, to))?;
        Ok::<f64, StudyError>(criterion.value(&Case::default(), &linear(&[gain], &[1.0, 1.0, 0.0])).unwrap().number)
    };
    let exact = margin("rad", "rad", 3.0).unwrap();
    for (from, to, gain) in
        [("V", "mV", 3e3), ("mV", "V", 3e-3), ("degC", "K", 3.0), ("rad", "deg", 540.0 / std::f64::consts::PI)]
    {
        assert_near(margin(from, to, gain).unwrap(), exact, 1e-12);
    }
    for (from, to) in [("V", "rad/s"), ("1", "m"), ("N", "1")] {
        let mistake = margin(from, to, 1.0).unwrap_err().to_string();
        assert!(
            mistake.contains(&format!("unity feedback cannot close a loop from `u` in {from} to `y` in {to}")),
            "{mistake}"
        );
    }
}
