use super::*;
use crate::testing::white;

fn wave(size: f64, noise: f64) -> Vec<f64> {
    let of = |(k, e): (usize, f64)| size * (math::sin(0.021 * k as f64) * 0.9 / size).round() + e;
    white("quantum", noise, 700).into_iter().enumerate().map(of).collect()
}

#[test]
fn the_size_of_steps_follows_from_the_values_alone() {
    for (size, noise) in [(0.017, 1e-3), (0.017, 2.5e-3), (0.0093, 0.0), (0.05, 1e-3)] {
        let found = quantum(&wave(size, noise), 3e-3, 0.06).expect("they are multiples");
        assert!((found / size - 1.0).abs() < 3e-3, "{found} of {size}");
    }
}

#[test]
fn values_at_rest_show_nothing_and_a_wide_range_is_looked_at_as_far_as_it_goes() {
    let rests: Vec<f64> = wave(0.017, 1e-3).into_iter().chain(white("rest", 1e-3, 3000)).collect();
    let found = quantum(&rests, 5e-3, 0.06).expect("those that move are multiples");
    assert!((found / 0.017 - 1.0).abs() < 3e-3, "{found}");
    let found = quantum(&wave(0.017, 0.0), 1e-6, 30.0).expect("they are multiples");
    assert!((found / 0.017 - 1.0).abs() < 1e-3, "{found}");
}

#[test]
fn values_that_come_in_no_steps_have_none() {
    let smooth: Vec<f64> = (0..700).map(|k| 0.9 * math::sin(0.021 * f64::from(k))).collect();
    assert!(quantum(&smooth, 3e-3, 0.06).is_none());
    assert!(quantum(&wave(0.004, 3e-3), 3e-3, 0.06).is_none(), "noise hides them");
}
