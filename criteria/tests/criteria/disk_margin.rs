//! Tests of the disk margin of feedback loops.

use mops_core::CriterionSpec;
use mops_criteria::disk_margin::DiskMargin;

use crate::testing::{assert_near, channel, linear, undefined, value};

#[test]
fn the_margin_of_an_integrator_is_the_largest_possible() {
    // S - 1/2 = (s - 1)/(2 (s + 1)) has the gain 1/2 at all frequencies.
    assert_near(value(&DiskMargin::default(), &linear(&[1.0], &[1.0, 0.0])).number, 2.0, 1e-9);
    // S - 1 is 0 without feedback.
    let none = value(&DiskMargin { skew: -1.0, ..DiskMargin::default() }, &linear(&[0.0], &[1.0, 1.0]));
    assert_eq!((none.number, none.note.is_some()), (100.0, true));
    let unstable = undefined(&DiskMargin::default(), &linear(&[9.0], &[1.0, 3.0, 3.0, 1.0]));
    assert_eq!(unstable, "the closed loop is not stable");
}

#[test]
fn a_skew_that_is_not_finite_is_refused() {
    let wrong = DiskMargin { skew: f64::NAN, ..DiskMargin::default() };
    let mistake = wrong.bind(&channel("V", "V")).err().unwrap().to_string();
    assert_eq!(mistake, "skew: expected a finite skew, found NaN");
}
