//! Tests of the gain within a mask over frequency.

use mops_core::Analysis;
use mops_criteria::gain_mask::GainMask;
use mops_linear::StateSpace;

use crate::testing::{assert_near, bound, linear, mistake, quantity, undefined, value};

fn mask(upper: &[(&str, &str)], lower: &[(&str, &str)], decibel: bool) -> GainMask {
    let points = |list: &[(&str, &str)]| list.iter().map(|(w, gain)| [quantity(w), quantity(gain)]).collect();
    GainMask { upper: points(upper), lower: points(lower), decibel, ..GainMask::default() }
}

#[test]
fn the_nearer_bound_counts_in_any_unit() {
    // |G| = 2/sqrt(1 + w^2): 2/sqrt 2 at 1 rad/s over 1 is sqrt 2, and 0.1/|G| at 10 rad/s is 0.5.
    let lag = linear(&[2.0], &[1.0, 1.0]);
    let plain = mask(&[("1", "1"), ("10", "1")], &[("1", "0.1"), ("10", "0.1")], false);
    assert_near(value(&plain, &lag).number, 2f64.sqrt(), 1e-9);
    let decibel = mask(&[("0.159154943091895 Hz", "20"), ("10 rad/s", "20")], &[("1", "0"), ("10", "-20")], true);
    // The lower bound is 1/w: sqrt(1 + w^2)/(2 w) is largest at 1 rad/s.
    assert_near(value(&decibel, &lag).number, 0.5f64.sqrt(), 1e-6);
    assert_eq!(bound(&plain).natural_demand(), Some(1.0));
}

#[test]
fn a_bound_above_half_of_the_sampling_frequency_has_no_value() {
    // Half of the sampling frequency is 2 pi rad/s.
    let sampled = |points: &[(&str, &str)]| {
        let Analysis::Linear(lag) = linear(&[1.0], &[1.0, 1.0]) else { unreachable!("it is linear") };
        (mask(points, &[], false), Analysis::Linear(StateSpace { period: Some(0.5), ..lag }))
    };
    let (above, system) = sampled(&[("10", "0.001"), ("100", "0.001")]);
    assert!(undefined(&above, &system).contains("above half of the sampling frequency"));
    let (across, system) = sampled(&[("1", "1"), ("100", "1")]);
    assert_eq!(value(&across, &system).note, Some("not compared above half of the sampling frequency"));
    let (below, system) = sampled(&[("1", "1"), ("6", "1")]);
    assert_eq!(value(&below, &system).note, None);
}

#[test]
fn masks_without_points_and_in_wrong_units_are_refused() {
    assert!(mistake(&mask(&[], &[], false)).contains("at least one bound"));
    assert!(mistake(&mask(&[("1", "1")], &[], false)).starts_with("upper: a mask needs at least two points"));
    assert!(mistake(&mask(&[("1 s", "1"), ("2", "1")], &[], false)).starts_with("upper: "));
}
