//! Tests of the bandwidth.

use mops_criteria::Of;
use mops_criteria::bandwidth::Bandwidth;

use crate::testing::{assert_near, linear, undefined, value};

#[test]
fn a_lag_and_the_loop_of_an_integrator_have_their_closed_forms() {
    let system = Bandwidth::default();
    assert_near(value(&system, &linear(&[3.0], &[0.5, 1.0])).number, 2.0, 1e-12);
    let closed = Bandwidth { of: Of::ClosedLoop, ..Bandwidth::default() };
    assert_near(value(&closed, &linear(&[7.0], &[1.0, 0.0])).number, 7.0, 1e-11);
    assert!(undefined(&system, &linear(&[7.0], &[1.0, 0.0])).contains("frequency 0"));
}
