//! Whiteness test of residuals, an assumption of standard errors.

use mops_math as math;
use schemars::JsonSchema;
use serde::Serialize;

/// Probability below which residuals do not count as white.
pub const UNLIKELY: f64 = 0.01;

/// Autocorrelation of residuals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Whiteness {
    /// Lag-1 autocorrelation, between -1 and 1; 0 for white residuals.
    pub lag1: f64,
    /// Ljung-Box statistic `Q = n (n + 2) sum_k r_k^2 / (n - k)` over the lags 1 to `lags`.
    pub ljung_box: f64,
    /// Number of lags, in samples.
    pub lags: usize,
    /// Probability of a larger `Q` for white residuals.
    pub probability: f64,
}

/// Tests residuals about their mean; returns `None` for fewer than 20, or if they do not vary. Gaps are ignored.
///
/// `Q` is compared with chi-squared with as many degrees of freedom as lags: ten, or fewer for fewer than 50 residuals.
/// Source: G. M. Ljung, G. E. P. Box, On a measure of lack of fit in time series models, Biometrika 65 (1978), 297-303.
#[allow(clippy::cast_precision_loss)]
pub fn whiteness(residuals: &[f64]) -> Option<Whiteness> {
    let n = residuals.len();
    if n < 20 {
        return None;
    }
    let mean = residuals.iter().sum::<f64>() / n as f64;
    let about: Vec<f64> = residuals.iter().map(|e| e - mean).collect();
    let power: f64 = about.iter().map(|e| e * e).sum();
    if !(power.is_finite() && power > 0.0) {
        return None;
    }
    // With an even number the tail of chi-squared is a finite sum.
    let lags = (n / 10 * 2).min(10);
    let correlation = |k: usize| about.iter().zip(&about[k..]).map(|(a, b)| a * b).sum::<f64>() / power;
    let sum: f64 = (1..=lags).map(|k| math::powi(correlation(k), 2) / (n - k) as f64).sum();
    let ljung_box = n as f64 * (n as f64 + 2.0) * sum;
    Some(Whiteness { lag1: correlation(1), ljung_box, lags, probability: tail(ljung_box, lags) })
}

/// Returns the probability that chi-squared with an even number of degrees of freedom exceeds `q`:
/// `exp(-q/2) sum_{k < freedom/2} (q/2)^k / k!`.
fn tail(q: f64, freedom: usize) -> f64 {
    let (mut term, mut sum) = (1.0, 0.0);
    for k in 1..=freedom / 2 {
        sum += term;
        #[allow(clippy::cast_precision_loss)]
        let next = 0.5 * q / k as f64;
        term *= next;
    }
    sum * math::exp(-0.5 * q)
}

impl Whiteness {
    /// Returns true if the test does not reject whiteness.
    pub fn is_white(&self) -> bool {
        self.probability >= UNLIKELY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns `n` values without a pattern.
    fn chirp(n: i32) -> Vec<f64> {
        (0..n).map(|i| math::sin(f64::from(i * i))).collect()
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-6 * b.abs().max(1e-3), "{a} is not {b}");
    }

    #[test]
    fn the_tail_of_chi_squared_has_its_tabulated_value() {
        // The 95 % point for 10 degrees of freedom is 18.307.
        assert!((tail(18.307, 10) - 0.05).abs() < 1e-5);
    }

    // Checks against the formulas, computed independently; the tail by numerical integration of the density.
    #[test]
    fn white_and_coloured_residuals_are_distinguished() {
        let white = whiteness(&chirp(60)).unwrap();
        close(white.lag1, -0.163_995_667_7);
        close(white.ljung_box, 8.027_409_057);
        close(white.probability, 0.626_159_546);
        assert!(white.is_white());
        let slow: Vec<f64> = (0..60).map(|i| math::sin(0.2 * f64::from(i))).collect();
        let slow = whiteness(&slow).unwrap();
        assert!(slow.lag1 > 0.9 && !slow.is_white());
    }

    #[test]
    fn too_few_or_constant_residuals_have_no_result() {
        assert_eq!(whiteness(&chirp(19)), None);
        assert_eq!(whiteness(&[1.0; 100]), None);
    }
}
