//! Tests of step size control.

use mops_models::kernel::StepSizes;

#[test]
fn an_error_equal_to_the_tolerance_gives_the_safety_factor_and_a_rejection_stays_within_its_bounds() {
    let mut sizes = StepSizes::new(5.0);
    sizes.after_acceptance(1.0, false);
    assert_eq!(sizes.after_acceptance(1.0, false), 0.9);
    assert_eq!(sizes.after_acceptance(0.0, false), 10.0);
    assert_eq!(sizes.after_acceptance(1e-3, true), 1.0);
    assert!((sizes.after_rejection(32.0) - 0.9 / 2.0).abs() < 1e-12);
    assert_eq!((sizes.after_rejection(1e300), sizes.after_rejection(f64::NAN)), (0.2, 0.1));
}
