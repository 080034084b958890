//! Confidence intervals of probabilities.

use super::distributions::{beta_cdf, beta_quantile};

/// Returns the Clopper-Pearson interval of a probability from `hits` in `count` independent trials. The interval
/// contains the true value with at least the probability `level`.
///
/// Source: C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404-413; ends from quantiles of beta distributions.
///
/// # Panics
/// If there are more hits than trials, or no trial.
#[allow(clippy::cast_precision_loss)]
pub fn share_interval(hits: usize, count: usize, level: f64) -> [f64; 2] {
    assert!(count > 0 && hits <= count, "`hits` must be at most `count`, and `count` positive");
    let (k, n, tail) = (hits as f64, count as f64, 0.5 * (1.0 - level));
    let low = if hits == 0 { 0.0 } else { beta_quantile(tail, k, n - k + 1.0) };
    let high = if hits == count { 1.0 } else { beta_quantile(1.0 - tail, k + 1.0, n - k) };
    [low, high]
}

/// Returns the probability of at most `hits` in `count` trials of probability `p`.
#[allow(clippy::cast_precision_loss)]
pub(super) fn at_most(hits: usize, count: usize, p: f64) -> f64 {
    if hits >= count {
        return 1.0;
    }
    beta_cdf(1.0 - p, (count - hits) as f64, (hits + 1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math as math;

    /// Checks no hit: `1 - (alpha/2)^(1/n)`. Five of ten: 0.1870860, 0.8129140 (R, binom.test). 263 of 300 against the
    /// sum of the binomial distribution at the ends.
    #[test]
    fn the_interval_is_that_of_clopper_and_pearson() {
        let [low, high] = share_interval(0, 20, 0.95);
        assert!(low == 0.0 && (high - (1.0 - math::powf(0.025, 1.0 / 20.0))).abs() < 1e-10, "{high}");
        let [low, high] = share_interval(5, 10, 0.95);
        assert!((low - 0.187_086_0).abs() < 1e-7 && (high - 0.812_914_0).abs() < 1e-7, "{low} {high}");
        let [low, high] = share_interval(263, 300, 0.95);
        assert!((at_most(263, 300, high) - 0.025).abs() < 1e-9 && (1.0 - at_most(262, 300, low) - 0.025).abs() < 1e-9);
    }

    #[test]
    fn the_binomial_distribution_sums_its_terms() {
        // n = 4, p = 0.3: 0.2401 + 0.4116 + 0.2646 = 0.9163.
        assert!((at_most(2, 4, 0.3) - 0.9163).abs() < 1e-12 && at_most(4, 4, 0.3) == 1.0);
    }
}
