use super::*;
use crate::testing::white;
use mops_math as math;

const NOISE: f64 = 1e-3;

/// A wave through a sensor with a gap about 0.2, sampled evenly over its phase: by the golden angle.
fn wave(half_width: f64) -> Vec<f64> {
    let shown = |y: f64| if (y - 0.2).abs() < half_width { 0.2 } else { y };
    let of = |(k, e): (usize, f64)| shown(math::sin(3.883222 * k as f64)) + e;
    white("gap", NOISE, 5000).into_iter().enumerate().map(of).collect()
}

#[test]
fn a_value_alone_shows_a_gap() {
    let gap = gap(&wave(0.05), NOISE).expect("there is one");
    assert!((gap.middle - 0.2).abs() < NOISE, "{gap:?}");
    assert!(gap.half_width > 0.05 - 3.0 * NOISE && gap.half_width < 0.075, "{gap:?}");
}

/// Noise reaches from either side into it, and nothing is empty for long.
#[test]
fn a_narrow_gap_is_found_by_how_many_samples_show_its_value() {
    let gap = gap(&wave(8.0 * NOISE), NOISE).expect("there is one");
    assert!((gap.middle - 0.2).abs() < NOISE, "{gap:?}");
    assert!((4.5 * NOISE..11.0 * NOISE).contains(&gap.half_width), "{gap:?}");
}

#[test]
fn a_rest_is_not_taken_for_a_gap_that_is_there() {
    let rest = white("rest", NOISE, 3000);
    let gap = gap(&[rest, wave(0.05)].concat(), NOISE).expect("there is one");
    assert!((gap.middle - 0.2).abs() < NOISE, "{gap:?}");
}

#[test]
fn a_motion_without_a_gap_shows_none() {
    assert_eq!(gap(&wave(0.0), NOISE), None);
    // Samples far apart, each alone; and many between two of them that are not one value.
    let sparse: Vec<f64> = (0..20).map(|k| 0.05 * f64::from(k)).collect();
    assert_eq!(gap(&sparse, NOISE), None);
    let spread: Vec<f64> = (0..40).map(|k| 0.3 + 1e-3 * f64::from(k)).chain([0.0, 1.0]).collect();
    assert_eq!(gap(&spread, NOISE), None);
}
