//! Band-limited interpolation of evenly spaced samples, without content above half the sampling frequency.

use std::sync::LazyLock;

/// Number of samples to either side used for a derivative.
const REACH: usize = 32;

/// Largest relative deviation of the steps between samples from their mean; beyond it, there is no sampling frequency.
pub const EVEN: f64 = 0.01;

/// Weights of the neighbours at 1, 2, .. samples in the first and the second derivative, for a step of 1, by reach.
///
/// Weights of the maximally flat differentiator: exact for polynomials of degree `2 reach`, equal to sinc interpolation
/// in the limit. Source: B. Fornberg, Generation of finite difference formulas on arbitrarily spaced grids, Mathematics
/// of Computation 51 (1988) 699.
struct Weights {
    first: Vec<f64>,
    second: Vec<f64>,
}

static WEIGHTS: LazyLock<Vec<Weights>> = LazyLock::new(|| (0..=REACH).map(Weights::of).collect());

#[allow(clippy::cast_precision_loss)]
impl Weights {
    fn of(reach: usize) -> Self {
        // (N!)^2/((N - k)! (N + k)!) for k = 1, 2, ..
        let window = (1..=reach).scan(1.0, |w, k| {
            *w *= (reach + 1 - k) as f64 / (reach + k) as f64;
            Some(*w)
        });
        let first: Vec<f64> =
            (1..=reach).zip(window).map(|(k, w)| if k % 2 == 1 { w / k as f64 } else { -w / k as f64 }).collect();
        let second = first.iter().enumerate().map(|(i, w)| 2.0 * w / (i + 1) as f64).collect();
        Self { first, second }
    }

    /// Returns the first and second derivative at sample `k`, per step and per step squared.
    ///
    /// Beyond its ends the signal is extended by point reflection.
    fn at(&self, values: &[f64], k: usize) -> (f64, f64) {
        let last = values.len() - 1;
        let before = |i: usize| if k >= i { values[k - i] } else { 2.0 * values[0] - values[i - k] };
        let after =
            |i: usize| if k + i <= last { values[k + i] } else { 2.0 * values[last] - values[2 * last - k - i] };
        let (mut first, mut second) = (0.0, 0.0);
        for (i, (a, b)) in self.first.iter().zip(&self.second).enumerate() {
            let (before, after) = (before(i + 1), after(i + 1));
            first += a * (after - before);
            second += b * (after + before - 2.0 * values[k]);
        }
        (first, second)
    }
}

/// Returns the coefficients `c0 + c1 s + .. + c5 s^5` of the signal from sample `k` (s = 0) to the next (s = 1). The
/// values and first two derivatives are those of the band-limited signal through evenly spaced samples.
///
/// Below half of the Nyquist frequency the error is less than 0.1 % of the amplitude, except near the ends of the
/// record.
///
/// # Panics
/// Panics if there is no sample `k + 1`.
pub fn piece(values: &[f64], k: usize) -> [f64; 6] {
    let weights = &WEIGHTS[REACH.min(values.len() - 1)];
    let ((a1, a2), (b1, b2)) = (weights.at(values, k), weights.at(values, k + 1));
    // Quintic through values, first and second derivatives at both ends.
    let (c0, c1, c2) = (values[k], a1, 0.5 * a2);
    let (rise, slope, bend) = (values[k + 1] - c0 - c1 - c2, b1 - c1 - 2.0 * c2, b2 - 2.0 * c2);
    let c3 = 10.0 * rise - 4.0 * slope + 0.5 * bend;
    let c4 = -15.0 * rise + 7.0 * slope - bend;
    let c5 = 6.0 * rise - 3.0 * slope + 0.5 * bend;
    [c0, c1, c2, c3, c4, c5]
}

/// Returns the value of the polynomial and of its derivative at `s`.
pub fn polynomial(c: &[f64; 6], s: f64) -> (f64, f64) {
    c.iter().rev().fold((0.0, 0.0), |(value, slope), &c| (value * s + c, slope * s + value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math as math;

    #[test]
    fn polynomials_are_met_to_rounding() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 0.5 * t * t - 0.1 * t * t * t;
        // Point reflection distorts a cubic at the ends: only the middle is checked, with the remaining reach.
        let values: Vec<f64> = (0..5).map(|i| cubic(f64::from(i))).collect();
        let weights = Weights::of(2);
        assert!((weights.at(&values, 2).0 - (-2.0 + 2.0 - 0.3 * 4.0)).abs() < 1e-12);
        assert!((weights.at(&values, 2).1 - (1.0 - 0.6 * 2.0)).abs() < 1e-12);
        let c = piece(&[1.0, 3.0, 5.0, 7.0], 1);
        assert!((polynomial(&c, 0.25).0 - 3.5).abs() < 1e-12 && (polynomial(&c, 0.25).1 - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_sine_of_half_the_highest_frequency_is_followed_between_its_samples() {
        let angular = 0.5 * std::f64::consts::PI;
        let sine = |t: f64| math::sin(angular * t + 0.3);
        let values: Vec<f64> = (0..200).map(|i| sine(f64::from(i))).collect();
        for s in [0.1, 0.5, 0.7] {
            let (value, slope) = polynomial(&piece(&values, 100), s);
            assert!((value - sine(100.0 + s)).abs() < 1e-3, "{value}");
            assert!((slope - angular * math::cos(angular * (100.0 + s) + 0.3)).abs() < 1e-2, "{slope}");
        }
    }
}
