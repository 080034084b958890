//! Tests of the common parts of criteria of linear systems: channel, value type, criterion.

use mops_core::{Case, CriterionSpec, Interface, StudyError};
use mops_criteria::{hinf_norm::HinfNorm, phase_margin::PhaseMargin};

use crate::testing::{assert_near, channel, linear, two_by_two};

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

#[test]
fn a_loop_may_lead_from_any_input_to_any_output_and_knows_both() {
    let named = |input: &str, output: &str| PhaseMargin { input: Some(input.into()), output: Some(output.into()) };
    let across = named("u2", "y1").bind(&two_by_two()).unwrap();
    assert_eq!(across.feedback_channel(), Some(["u2".to_owned(), "y1".to_owned()]));
    let cut = named("u2", "y1").bind(&Interface { is_cut: true, ..two_by_two() }).err().unwrap().to_string();
    assert_eq!(cut, "output: the output of the loop cut at `u2` is `-u2`, not `y1`; remove `output`");
    let whole = HinfNorm { input: Some("u1".into()), output: Some("y2".into()) }.bind(&two_by_two()).unwrap();
    assert_eq!(whole.feedback_channel(), None);
}
