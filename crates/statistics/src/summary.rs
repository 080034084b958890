//! Summary statistics and quantiles of a sample.

use mops_math as math;

use super::share::at_most;

/// Mean, spread and range of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// Mean.
    pub mean: f64,
    /// Standard deviation: the square root of the sum of squared differences from the mean over `n - 1`.
    pub deviation: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

impl Summary {
    /// Summarises a sample; all fields are NaN for an empty one.
    #[allow(clippy::cast_precision_loss)]
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|v| math::powi(v - mean, 2)).sum();
        let end = |pick: fn(f64, f64) -> f64| values.iter().copied().reduce(pick).unwrap_or(f64::NAN);
        let deviation = if values.len() > 1 { (squares / (n - 1.0)).sqrt() } else { f64::NAN };
        Self { mean, deviation, min: end(f64::min), max: end(f64::max) }
    }
}

/// Returns the quantile of a sorted sample by linear interpolation, with the smallest value at 0 and the largest at 1.
///
/// Source: R. J. Hyndman, Y. Fan, The American Statistician 50 (1996) 361-365, definition 7.
///
/// # Panics
/// If the sample is empty.
#[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub fn quantile(sorted: &[f64], p: f64) -> f64 {
    let place = p.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

/// Returns the distribution-free confidence interval of a quantile.
///
/// Its ends are two values of the sorted sample, between which the quantile lies with at least the probability `level`.
/// An end is NaN if the sample is too small.
///
/// The number of n independent values below the quantile of p is binomial. The r-th smallest value exceeds the quantile
/// with the probability that fewer than r lie below it. Source: H. A. David, H. N. Nagaraja, Order Statistics, 3rd
/// edition (2003), 7.1.
pub fn quantile_interval(sorted: &[f64], p: f64, level: f64) -> [f64; 2] {
    let (n, tail) = (sorted.len(), 0.5 * (1.0 - level));
    // Largest r with P(at most r - 1 below) <= tail, smallest s with P(at most s - 1 below) >= 1 - tail.
    let low = (1..=n).take_while(|&r| at_most(r - 1, n, p) <= tail).last();
    let high = (1..=n).find(|&s| at_most(s - 1, n, p) >= 1.0 - tail);
    [low, high].map(|rank| rank.map_or(f64::NAN, |rank| sorted[rank - 1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_is_that_of_the_textbook() {
        let found = Summary::of(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]);
        assert_eq!((found.mean, found.min, found.max), (5.0, 2.0, 9.0));
        assert!((found.deviation - (32.0_f64 / 7.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn quantiles_lie_on_lines_between_values() {
        let sorted = [1.0, 2.0, 4.0, 8.0];
        assert_eq!([0.0, 0.5, 0.9, 1.0].map(|p| (quantile(&sorted, p) * 1e9).round() / 1e9), [1.0, 3.0, 6.8, 8.0]);
    }

    /// Checks the published ranks for the median of 20 values at 95 %: 6 and 15; for 5 values no such interval exists.
    #[test]
    fn the_interval_of_a_median_is_between_published_ranks() {
        let sorted: Vec<f64> = (1..=20).map(f64::from).collect();
        assert_eq!(quantile_interval(&sorted, 0.5, 0.95), [6.0, 15.0]);
        assert!(quantile_interval(&sorted[..5], 0.5, 0.95).iter().all(|end| end.is_nan()));
    }
}
