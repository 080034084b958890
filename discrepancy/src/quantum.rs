//! The quantum of measured values: the size of the steps in which they come.
//!
//! Source: D. G. Kendall, Hunting quanta, Philosophical Transactions of the Royal Society A 276 (1974) 231: the cosine
//! quantogram, here the mean of the cosines.

use mops_math as math;
use std::f64::consts::TAU;

use crate::settings::settings;

/// Values of the frequency in the width of a peak, and most of them in all: beyond, steps are finer than is looked for.
const PER_PEAK: f64 = 6.0;
const MOST: f64 = 1e4;

/// The quantum between the finest and the coarsest that is asked for; `None` where the values are multiples of none.
pub fn quantum(values: &[f64], finest: f64, coarsest: f64) -> Option<f64> {
    // What rests at 0 is a multiple of everything.
    let values: Vec<f64> = values.iter().copied().filter(|v| v.abs() >= finest).collect();
    let reach = values.iter().map(|v| v.abs()).fold(0.0, f64::max);
    let (lowest, highest) = (1.0 / coarsest.min(reach), 1.0 / finest);
    let step = 1.0 / (PER_PEAK * reach);
    let count = ((highest - lowest) / step).min(MOST);
    if count.is_nan() || count <= 0.0 {
        return None;
    }
    #[allow(clippy::cast_precision_loss)]
    let mean =
        |frequency: f64| values.iter().map(|v| math::cos(TAU * frequency * v)).sum::<f64>() / values.len() as f64;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let frequencies: Vec<f64> = (0..=count as u32).map(|k| lowest + f64::from(k) * step).collect();
    let means: Vec<f64> = frequencies.iter().map(|&frequency| mean(frequency)).collect();
    let best = means.iter().copied().fold(0.0, f64::max);
    let is_peak = |k: usize| k > 0 && means[k] >= means[k - 1] && (k + 1 == means.len() || means[k] > means[k + 1]);
    let first = (0..means.len())
        .find(|&k| is_peak(k) && means[k] >= settings().quantum_share * best && means[k] > settings().quantum_cosine)?;
    Some(1.0 / highest_near(mean, frequencies[first], step))
}

/// The place of a maximum within a step of a frequency, by ternary search.
fn highest_near(mean: impl Fn(f64) -> f64, frequency: f64, step: f64) -> f64 {
    let [mut low, mut high] = [frequency - step, frequency + step];
    for _ in 0..40 {
        let third = (high - low) / 3.0;
        let (a, b) = (low + third, high - third);
        if mean(a) < mean(b) { low = a } else { high = b }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::white;

    fn wave(size: f64, noise: f64) -> Vec<f64> {
        let of = |(k, e): (usize, f64)| size * (math::sin(0.021 * k as f64) * 0.9 / size).round() + e;
        white("quantum", noise, 700).into_iter().enumerate().map(of).collect()
    }

    #[test]
    fn the_size_of_steps_is_told_by_the_values_alone() {
        for (size, noise) in [(0.017, 1e-3), (0.017, 2.5e-3), (0.0093, 0.0), (0.05, 1e-3)] {
            let found = quantum(&wave(size, noise), 3e-3, 0.06).expect("they are multiples");
            assert!((found / size - 1.0).abs() < 3e-3, "{found} of {size}");
        }
    }

    #[test]
    fn values_at_rest_tell_nothing_and_a_wide_range_is_looked_at_as_far_as_it_goes() {
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
}
