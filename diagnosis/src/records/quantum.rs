//! The quantum of measured values: the size of the steps in which they come.
//!
//! Source: D. G. Kendall, Hunting quanta, Philosophical Transactions of the Royal Society A 276 (1974) 231: the cosine
//! quantogram, here the mean of the cosines.

use mops_math as math;
use std::f64::consts::TAU;

/// Mean cosine from which values are multiples of a quantum. Basis: values that scatter about them by a fifth of it.
const QUANTUM_COSINE: f64 = 0.45;

/// Share of the best mean cosine that a larger quantum must have to be taken. Basis: two standard errors of the mean of
/// 50 cosines, `sqrt(1/(2 n))` each.
const QUANTUM_SHARE: f64 = 0.8;

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
    let first =
        (0..means.len()).find(|&k| is_peak(k) && means[k] >= QUANTUM_SHARE * best && means[k] > QUANTUM_COSINE)?;
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
mod tests;
