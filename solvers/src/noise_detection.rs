//! Detection of noise and kinks in the criteria near a point, from values along lines.

use mops_core::{Halt, Oracle, Usage};
use mops_math as math;
use rand::Rng;

/// Smoothness of the criteria along lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Smoothness {
    /// Smooth: higher-order differences decay.
    Smooth,
    /// Kinks: differences do not decay, but finite-difference derivatives are consistent with the values.
    Nonsmooth,
    /// Noise: finite-difference derivatives do not predict neighbouring values.
    Noisy,
}

/// Number of values on a line.
const VALUES: usize = 7;

/// Spacing of the values, in the unit box. Noise that is smooth below this distance does no harm.
const SPACING: f64 = 1e-3;

/// Finer spacing, to distinguish strong curvature from kinks.
const FINE_SPACING: f64 = 1e-4;

/// Difference step of the derivatives, in the unit box.
const DIFFERENCE_STEP: f64 = 1e-5;

/// Relative noise level regarded as zero: finite differences of simulations tolerate it.
const NEGLIGIBLE_NOISE: f64 = 1e-6;

/// Ratio of the RMS differences of derivatives and of chords above which values are noisy. For a kink halfway between
/// two values the ratio is sqrt(2).
const NOISE_RATIO: f64 = 2.2;

/// Classifies the criteria near a point; the least smooth criterion decides.
///
/// Noise is the part of the values that does not decay from one order of differences to the next. A criterion is noisy
/// only if two lines agree and its derivatives vary more than the chords between its values. Otherwise a third line
/// with a finer spacing distinguishes strong curvature from kinks. A failed point counts as a kink.
///
/// With the `k`-th differences `T` of equidistant values, the noise level is the square root of `(k!)^2 / (2 k)!` times
/// the mean of `T^2`. The first `k` is taken whose level agrees with the next two within a factor of 4 and whose
/// differences have both signs.
///
/// Source: J. J. More, S. M. Wild, Estimating computational noise, SIAM J. Scientific Computing 33 (2011) 1292-1314,
/// section 6. N.B.: the paper does not distinguish kinks from noise; the derivatives do.
///
/// # Errors
/// When the run ends: budget exhausted, or interrupted by the user.
pub fn detect_smoothness(oracle: &mut dyn Oracle, start: &[f64]) -> Result<Smoothness, Halt> {
    let mut random = oracle.stream("texture");
    // Start beside the initial guess, which may lie on a kink by design, and go towards the centre of the box.
    let mut line = |spacing: f64| -> Vec<[f64; 2]> {
        let coordinate = |u: &f64| {
            let direction = if *u < 0.5 { 1.0 } else { -1.0 };
            [u + direction * SPACING * random.random::<f64>(), direction * spacing * random.random_range(0.5..1.0)]
        };
        start.iter().map(coordinate).collect()
    };
    let mut ratios: Vec<f64> = Vec::new();
    for _ in 0..2 {
        let line = line(SPACING);
        let Some(rows) = values_on_line(oracle, &line, 0.0)? else { return Ok(Smoothness::Nonsmooth) };
        ratios.resize(rows.len(), 1.0);
        for (values, ratio) in rows.iter().zip(&mut ratios) {
            if differences_decay(values) {
                *ratio = 0.0;
            }
        }
        if ratios.iter().all(|ratio| *ratio == 0.0) {
            return Ok(Smoothness::Smooth);
        }
        let Some(shifted) = values_on_line(oracle, &line, DIFFERENCE_STEP / SPACING)? else {
            return Ok(Smoothness::Nonsmooth);
        };
        for ((values, shifted), ratio) in rows.iter().zip(&shifted).zip(&mut ratios) {
            let derivatives: Vec<f64> =
                shifted.iter().zip(values).map(|(b, v)| (b - v) * SPACING / DIFFERENCE_STEP).collect();
            let chords: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
            *ratio *= rms_difference(&derivatives) / rms_difference(&chords).max(f64::MIN_POSITIVE);
        }
    }
    // The geometric mean over both lines.
    if ratios.iter().any(|ratio| *ratio > NOISE_RATIO * NOISE_RATIO) {
        return Ok(Smoothness::Noisy);
    }
    // Strong curvature resembles a kink at the coarse spacing.
    let Some(rows) = values_on_line(oracle, &line(FINE_SPACING), 0.0)? else { return Ok(Smoothness::Nonsmooth) };
    Ok(if rows.iter().all(|values| differences_decay(values)) { Smoothness::Smooth } else { Smoothness::Nonsmooth })
}

/// Returns the values of every objective and constraint on a line, shifted by a fraction of the spacing; `None` if a
/// point fails.
#[allow(clippy::cast_precision_loss)]
fn values_on_line(oracle: &mut dyn Oracle, line: &[[f64; 2]], shift: f64) -> Result<Option<Vec<Vec<f64>>>, Halt> {
    let at = |i: usize| {
        line.iter().map(|[origin, increment]| (origin + (i as f64 + shift) * increment).clamp(0.0, 1.0)).collect()
    };
    let answers = oracle.evaluate(&(0..VALUES).map(at).collect::<Vec<_>>())?;
    let Some(scaled) = answers.iter().map(|a| a.scaled.as_ref()).collect::<Option<Vec<_>>>() else { return Ok(None) };
    let relevant = oracle.shape().rows.iter().enumerate().filter(|(_, (usage, _))| *usage != Usage::Monitor);
    Ok(Some(relevant.map(|(row, _)| scaled.iter().map(|values| values[row]).collect()).collect()))
}

/// Returns the root mean square of the differences of neighbouring values.
#[allow(clippy::cast_precision_loss)]
fn rms_difference(values: &[f64]) -> f64 {
    let squares: f64 = values.windows(2).map(|pair| math::powi(pair[1] - pair[0], 2)).sum();
    (squares / (values.len() - 1) as f64).sqrt()
}

/// Returns true if the differences of equidistant values decay from order to order.
fn differences_decay(values: &[f64]) -> bool {
    let size = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    estimate_noise(values).is_none_or(|noise| noise <= NEGLIGIBLE_NOISE * size)
}

/// Estimates the noise level of equidistant values; `None` if no noise is found.
#[allow(clippy::cast_precision_loss)]
fn estimate_noise(values: &[f64]) -> Option<f64> {
    let mut differences = values.to_vec();
    let mut factor = 1.0;
    let mut levels: Vec<(f64, bool)> = Vec::with_capacity(values.len());
    for k in 1..values.len() {
        differences = differences.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // (k!)^2 / (2 k)! by recursion.
        factor *= k as f64 / (2.0 * (2 * k - 1) as f64);
        let mean = differences.iter().map(|t| t * t).sum::<f64>() / differences.len() as f64;
        let has_both_signs = differences.iter().any(|t| *t < 0.0) && differences.iter().any(|t| *t > 0.0);
        levels.push(((factor * mean).sqrt(), has_both_signs));
    }
    let agree = |three: &&[(f64, bool)]| {
        let largest = three.iter().map(|(level, _)| *level).fold(0.0, f64::max);
        let smallest = three.iter().map(|(level, _)| *level).fold(f64::INFINITY, f64::min);
        three[0].1 && largest <= 4.0 * smallest && smallest > 0.0
    };
    levels.windows(3).find(agree).map(|three| three[0].0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_found_on_a_parabola_and_smooth_functions_have_none() {
        let mut random = mops_math::stream(1, "noise");
        let mut ratios = Vec::new();
        for _ in 0..100 {
            let mut noisy = |i: u32| 3.0 + math::powi(f64::from(i) * 1e-3, 2) + 1e-4 * random.random_range(-1.0..1.0);
            let values: Vec<f64> = (0..7).map(&mut noisy).collect();
            // The standard deviation of a uniform distribution between -1 and 1 is 1 / sqrt(3).
            ratios.extend(estimate_noise(&values).map(|noise| noise / (1e-4 / 3.0_f64.sqrt())));
        }
        ratios.sort_by(f64::total_cmp);
        assert!(ratios.len() > 70 && (0.5..2.0).contains(&ratios[ratios.len() / 2]), "{ratios:?}");
        let smooth = |f: fn(f64) -> f64| estimate_noise(&(0..7).map(|i| f(f64::from(i) * 1e-3)).collect::<Vec<_>>());
        for f in
            [|x: f64| math::sin(30.0 * x) + 2.0, |x: f64| math::exp(50.0 * x), |x: f64| 1e6 * math::powi(x, 4) + 1.0]
        {
            assert!(smooth(f).is_none_or(|noise| noise < 1e-9), "{:?}", smooth(f));
        }
    }
}
