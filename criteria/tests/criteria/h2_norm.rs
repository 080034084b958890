//! Tests of the H2 norm.

use mops_criteria::h2_norm::H2Norm;

use crate::testing::{assert_near, linear, undefined, value};

#[test]
fn the_norm_of_a_lag_has_its_closed_form() {
    // k/(s + p): k/sqrt(2 p).
    assert_near(value(&H2Norm::default(), &linear(&[3.0], &[1.0, 2.0])).number, 1.5, 1e-14);
    assert!(undefined(&H2Norm::default(), &linear(&[1.0], &[1.0, -1.0])).contains("not stable"));
}
