//! Tests of the Hinf norm.

use mops_core::CriterionSpec;
use mops_criteria::hinf_norm::HinfNorm;

use crate::testing::{assert_near, channel, linear, undefined, value};

#[test]
fn the_norm_of_a_resonance_has_its_closed_form() {
    // w^2/(s^2 + 2 z w s + w^2): 1/(2 z sqrt(1 - z^2)).
    let found = value(&HinfNorm::default(), &linear(&[9.0], &[1.0, 0.06, 9.0])).number;
    assert_near(found, 1.0 / (0.02 * f64::sqrt(1.0 - 1e-4)), 1e-6);
    assert!(undefined(&HinfNorm::default(), &linear(&[1.0], &[1.0, -1.0])).contains("not stable"));
    let actuated = HinfNorm::default().bind(&channel("V", "m")).unwrap();
    assert_eq!(actuated.unit(), mops_language::Unit::known("m/V"));
}
