//! Tests of the slowest pole.

use mops_criteria::Of;
use mops_criteria::slowest_pole::SlowestPole;

use crate::testing::{assert_near, linear, linear_delayed, undefined, value};

#[test]
fn the_pole_farthest_to_the_right_counts() {
    assert_near(value(&SlowestPole::default(), &linear(&[1.0], &[1.0, 3.0, 2.0])).number, -1.0, 1e-14);
    // 5/((s - 1)(s + 4)) in feedback: s^2 + 3 s + 1.
    let closed = SlowestPole { of: Of::ClosedLoop, ..SlowestPole::default() };
    let exact = -1.5 + 1.25f64.sqrt();
    assert_near(value(&closed, &linear(&[5.0], &[1.0, 3.0, -4.0])).number, exact, 1e-13);
    assert!(undefined(&closed, &linear_delayed(&[5.0], &[1.0, 3.0, -4.0], 0.1)).contains("delay"));
}
