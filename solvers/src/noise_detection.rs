//! What the rows of a problem are like near a point, found out from a few values along lines.

use mops_core::math;
use mops_core::{Halt, Oracle, Usage};
use rand::Rng;

/// What values along lines tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Smoothness {
    /// Differences fade from order to order.
    Smooth,
    /// They do not, but slopes agree with them: there are kinks.
    Nonsmooth,
    /// Slopes say nothing of neighbouring values.
    Noisy,
}

/// Values along a line.
const VALUES: usize = 7;

/// Distance of neighbouring ones, in the unit box: noise that is smooth at a smaller distance does nobody harm there.
const SPACING: f64 = 1e-3;

/// The same where values so far apart may be those of smooth rows that bend more.
const FINE_SPACING: f64 = 1e-4;

/// Distance over which slopes are taken, in the unit box.
const DIFFERENCE_STEP: f64 = 1e-5;

/// Relative noise below which there is none: differences of simulations are meant for that much.
const NEGLIGIBLE_NOISE: f64 = 1e-6;

/// How much more slopes differ than chords do where values are noise. Where a kink lies halfway between two values, it is the
/// root of 2.
const NOISE_RATIO: f64 = 2.2;

/// What the rows are like near a point: the roughest of them. Noise is what does not fade from difference to difference; it is
/// one only where two lines agree, and where slopes differ more than the chords between the values do. Where they do not, a
/// third line with smaller distances tells rows that bend from rows with kinks. Points that fail count as a kink.
///
/// With the `k`-th differences `T` of values at equal distances, the noise is the root of `(k!)^2 / (2 k)!` times the mean of
/// `T^2`, for the first `k` that agrees with the next two within a factor of 4 and whose differences have both signs.
///
/// Source: J. J. More, S. M. Wild, Estimating computational noise, SIAM J. Scientific Computing 33 (2011) 1292-1314,
/// section 6. N.B.: they do not tell kinks from noise; the slopes do.
///
/// # Errors
/// The run is over.
pub fn detect_smoothness(oracle: &mut dyn Oracle, start: &[f64]) -> Result<Smoothness, Halt> {
    let mut random = oracle.stream("texture");
    // From a little beside the start, where kinks are made on purpose, towards the middle of the box.
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
    // The geometric mean of both lines.
    if ratios.iter().any(|ratio| *ratio > NOISE_RATIO * NOISE_RATIO) {
        return Ok(Smoothness::Noisy);
    }
    // What bends within a few distances looks like a kink, until one looks closer.
    let Some(rows) = values_on_line(oracle, &line(FINE_SPACING), 0.0)? else { return Ok(Smoothness::Nonsmooth) };
    Ok(if rows.iter().all(|values| differences_decay(values)) { Smoothness::Smooth } else { Smoothness::Nonsmooth })
}

/// Values of every row that counts along a line, each a part of the distance further; `None` where a point fails.
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

/// Root mean square of the differences of neighbours.
#[allow(clippy::cast_precision_loss)]
fn rms_difference(values: &[f64]) -> f64 {
    let squares: f64 = values.windows(2).map(|pair| math::powi(pair[1] - pair[0], 2)).sum();
    (squares / (values.len() - 1) as f64).sqrt()
}

/// Whether differences of values at equal distances fade from order to order.
fn differences_decay(values: &[f64]) -> bool {
    let size = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    estimate_noise(values).is_none_or(|noise| noise <= NEGLIGIBLE_NOISE * size)
}

/// The noise of values at equal distances; `None` where none is found.
#[allow(clippy::cast_precision_loss)]
fn estimate_noise(values: &[f64]) -> Option<f64> {
    let mut differences = values.to_vec();
    let mut factor = 1.0;
    let mut levels: Vec<(f64, bool)> = Vec::with_capacity(values.len());
    for k in 1..values.len() {
        differences = differences.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // (k!)^2 / (2 k)!, from the one before.
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
        let mut random = mops_core::stream(1, "noise");
        let mut ratios = Vec::new();
        for _ in 0..100 {
            let mut noisy = |i: u32| 3.0 + math::powi(f64::from(i) * 1e-3, 2) + 1e-4 * random.random_range(-1.0..1.0);
            let values: Vec<f64> = (0..7).map(&mut noisy).collect();
            // The standard deviation of even noise between -1 and 1.
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
