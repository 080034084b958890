//! Tests of the comparison of a simulated signal with its measurement.

use mops_criteria::rmse::Rmse;

use crate::testing::{measured, simulated, undefined_in};

#[test]
fn a_measurement_that_was_not_simulated_is_not_compared() {
    let rmse = Rmse { signal: "y".into() };
    let simulation = simulated(1.0, |t| t);
    let long = measured(&[0.0, 1.0, 2.0], &[0.0; 3], None);
    assert_eq!(
        undefined_in(&long, &rmse, &simulation),
        "`y` is measured from 0 s to 2 s but simulated from 0 s to 1 s"
    );
    let other = mops_core::Case { name: "swing".into(), ..mops_core::Case::default() };
    assert_eq!(undefined_in(&other, &rmse, &simulation), "`swing` does not measure `y`");
}
