//! Tests of the disk margin of feedback loops.

use mops_core::{Analysis, Case, CriterionSpec, Interface};
use mops_criteria::disk_margin::DiskMargin;
use mops_linear::StateSpace;
use nalgebra::DMatrix;

use crate::testing::{assert_near, channel, linear, two_by_two, undefined, value};

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

#[test]
fn of_all_loops_at_once_the_margin_is_that_of_the_worst() {
    // The loops `[1 c; -c 1]/s` have the eigenvalues (1 +- jc)/s: S - I/2, a normal matrix that no scaling makes
    // smaller, has the norm sqrt((1 + (w - c)^2)/(1 + (w + c)^2))/2, for c = 1 at most (1 + sqrt(2))/2, where
    // w = -sqrt(2).
    let model = Interface { is_cut: true, ..two_by_two() };
    let of = |coupling: f64| {
        let (identity, zero) = (DMatrix::identity(2, 2), DMatrix::zeros(2, 2));
        let c = DMatrix::from_row_slice(2, 2, &[1.0, coupling, -coupling, 1.0]);
        let names = |name: &str| vec![format!("{name}1"), format!("{name}2")];
        let system = StateSpace {
            a: zero.clone(),
            b: identity,
            c,
            d: zero,
            states: names("x"),
            inputs: names("u"),
            outputs: names("y"),
            delay: 0.0,
            period: None,
        };
        let bound = DiskMargin::default().bind(&model).unwrap();
        assert_eq!((bound.signals(), bound.range()), (vec!["y1".to_owned(), "y2".to_owned()], [0.0, 100.0]));
        bound.value(&Case::default(), &Analysis::Linear(system)).unwrap().number
    };
    assert_near(of(0.0), 2.0, 1e-6);
    assert_near(of(1.0), 2.0 * (f64::sqrt(2.0) - 1.0), 1e-6);
}
