//! Noise and outliers of the samples of a channel, before any model is looked at.

use mops_math as math;

/// Share of the differences of samples that must be multiples of the smallest one for a quantisation. Basis: the
/// studies.
const QUANTISED: f64 = 0.9;

/// Returns the standard deviation of the noise of a sensor from its records: the median of that of each, at least that
/// of its quantisation. `None` if there are too few samples, or they never change.
pub fn noise_of(records: &[(&[f64], &[f64])]) -> Option<f64> {
    noise_beside(records, records)
}

/// Returns the standard deviation of the noise like [`noise_of`], but from the residuals of a model: fast motion would
/// be taken for noise.
pub fn noise_beside(records: &[(&[f64], &[f64])], residuals: &[(&[f64], &[f64])]) -> Option<f64> {
    let mut all: Vec<f64> = residuals.iter().filter_map(|(times, values)| noise_of_record(times, values)).collect();
    all.sort_by(f64::total_cmp);
    // Of two, the smaller one.
    let median = *all.get(all.len().checked_sub(1)? / 2)?;
    Some(step(records).map_or(median, |step| median.max(step / 12.0_f64.sqrt())))
}

/// Returns the standard deviation of the noise of a record: what local parabolas over seven samples leave, by the
/// median absolute deviation, so that a few jumps do not count.
///
/// Source: T. Gasser, L. Sroka, C. Jennen-Steinmetz, Residual variance and residual pattern in nonlinear regression,
/// Biometrika 73 (1986) 625; P. Rousseeuw, A. Leroy, Robust Regression and Outlier Detection (1987), section 4.4
/// (1.4826).
#[allow(clippy::cast_precision_loss)]
fn noise_of_record(times: &[f64], values: &[f64]) -> Option<f64> {
    let of = |i: usize| {
        let x: Vec<f64> = (i - 3..=i + 3).map(|k| times[k] - times[i]).collect();
        let others: Vec<usize> = (0..7).filter(|&k| k != 3).collect();
        let (predicted, leverage) = parabola(&others, &x, &values[i - 3..=i + 3])?;
        Some((values[i] - predicted).abs() / (1.0 + leverage).sqrt())
    };
    let mut left: Vec<f64> = (3..values.len().saturating_sub(3)).filter_map(of).collect();
    left.sort_by(f64::total_cmp);
    let median = left.get(left.len() / 2)?;
    // Coarse quantisation leaves many exact zeros: then the root mean square says more, without the largest twentieth,
    // where samples that stand alone are; with it only if nothing else is left.
    let rms = |of: &[f64]| (of.iter().map(|r| r * r).sum::<f64>() / of.len() as f64).sqrt();
    let trimmed = rms(&left[..left.len() - left.len() / 20]);
    let rms = if trimmed > 0.0 { trimmed } else { rms(&left) };
    let robust = 1.4826 * median;
    let noise = if robust > 0.1 * rms { robust } else { rms };
    let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    (noise > ROUNDING * largest).then_some(noise)
}

/// Share of the largest value up to which a difference is rounding.
const ROUNDING: f64 = 1e-12;

/// Returns the quantisation step of records: the smallest difference of two samples, if most differences are multiples
/// of it.
#[allow(clippy::cast_precision_loss)]
fn step(records: &[(&[f64], &[f64])]) -> Option<f64> {
    let largest = records.iter().flat_map(|(_, values)| *values).fold(0.0, |m: f64, v| m.max(v.abs()));
    let differences = |(_, values): &(&[f64], &[f64])| -> Vec<f64> {
        values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|d| *d > ROUNDING * largest).collect()
    };
    let all: Vec<f64> = records.iter().flat_map(differences).collect();
    let step = all.iter().copied().reduce(f64::min)?;
    let is_multiple = |d: &&f64| (*d / step - (*d / step).round()).abs() < MULTIPLE;
    (all.iter().filter(is_multiple).count() as f64 >= QUANTISED * all.len() as f64).then_some(step)
}

/// Distance from a whole number up to which a ratio of differences is one: the rounding of decimals.
const MULTIPLE: f64 = 0.05;

/// The value at 0 of the parabola through the chosen samples, and the sum of the squares of the weights that give it.
fn parabola(chosen: &[usize], x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    let scale = x.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let mut m = nalgebra::Matrix3::zeros();
    for &k in chosen {
        let row = nalgebra::Vector3::new(1.0, x[k] / scale, math::powi(x[k] / scale, 2));
        m += row * row.transpose();
    }
    let inverse = m.try_inverse()?;
    let (mut value, mut leverage) = (0.0, 0.0);
    for &k in chosen {
        let row = nalgebra::Vector3::new(1.0, x[k] / scale, math::powi(x[k] / scale, 2));
        let weight = (inverse * row)[0];
        value += weight * y[k];
        leverage += weight * weight;
    }
    Some((value, leverage))
}

/// The samples without those that stand alone, more than ten times the noise from what their neighbours on both sides
/// lead to, and how many those were. The first and the last have neighbours on one side alone: there it may be a
/// transient.
pub fn without_spikes(times: &[f64], values: &[f64], noise: f64) -> (Vec<f64>, Vec<f64>, usize) {
    let n = values.len();
    let alone = |i: usize| {
        if n < 8 || i == 0 || i == n - 1 {
            return false;
        }
        let from = i.saturating_sub(3).min(n - 7);
        let x: Vec<f64> = (from..from + 7).map(|k| times[k] - times[i]).collect();
        let others: Vec<usize> = (0..7).filter(|&k| from + k != i).collect();
        let Some((predicted, leverage)) = parabola(&others, &x, &values[from..from + 7]) else { return false };
        let spread = others.iter().map(|&k| {
            let rest: Vec<usize> = others.iter().copied().filter(|&o| o != k).collect();
            let moved: Vec<f64> = x.iter().map(|v| v - x[k]).collect();
            parabola(&rest, &moved, &values[from..from + 7]).map_or(0.0, |(p, _)| (values[from + k] - p).abs())
        });
        let spread = spread.fold(0.0, f64::max);
        let off = (values[i] - predicted).abs() / (1.0 + leverage).sqrt();
        off > 10.0 * noise && off > 4.0 * spread
    };
    let kept: Vec<usize> = (0..n).filter(|&i| !alone(i)).collect();
    let dropped = n - kept.len();
    (kept.iter().map(|&i| times[i]).collect(), kept.iter().map(|&i| values[i]).collect(), dropped)
}

#[cfg(test)]
mod tests;
