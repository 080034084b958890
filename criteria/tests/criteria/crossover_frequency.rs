//! Tests of the gain crossover frequency of a feedback loop.

use mops_core::criterion::Missed;
use mops_criteria::crossover_frequency::CrossoverFrequency;
use mops_math as math;

use crate::testing::{assert_near, linear, value};

#[test]
fn the_crossover_of_a_third_order_lag_has_its_closed_form() {
    let found = value(&CrossoverFrequency::default(), &linear(&[4.0], &[1.0, 3.0, 3.0, 1.0])).number;
    assert_near(found, (math::powf(4.0, 2.0 / 3.0) - 1.0).sqrt(), 1e-12);
    let never = value(&CrossoverFrequency::default(), &linear(&[0.5], &[1.0, 1.0]));
    assert_eq!((never.missed, never.note), (Some(Missed { horizon: None }), Some("the loop gain is never 1")));
    assert_near(never.number, 1.0 + 0.5 / 0.51, 1e-12);
    // A distance of 0.75 from the gain 1.
    let far = value(&CrossoverFrequency::default(), &linear(&[0.25], &[1.0, 1.0]));
    assert_near(far.number, 1.0 + 0.75 / 0.76, 1e-12);
}
