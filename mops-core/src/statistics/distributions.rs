//! Distribution functions and quantiles, over [`crate::math`] and so with the same bits on every machine.

use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};

use crate::math;

/// Probability that a standard normal number is at most `x`.
pub fn normal_cdf(x: f64) -> f64 {
    0.5 * math::erfc(-x * FRAC_1_SQRT_2)
}

/// The value that a share `p` of the standard normal distribution does not exceed; infinite for 0 and 1.
pub fn normal_quantile(p: f64) -> f64 {
    if p > 0.5 {
        return -normal_quantile(1.0 - p);
    }
    -SQRT_2 * last(f64::INFINITY, |z| 0.5 * math::erfc(z) > p)
}

/// Probability that a number of the beta distribution is at most `x`: the regularised incomplete beta function `I_x(a, b)`.
pub fn beta_cdf(x: f64, a: f64, b: f64) -> f64 {
    incomplete_beta([x, 1.0 - x], [a, b])
}

/// The value that a share `p` of the beta distribution does not exceed.
pub fn beta_quantile(p: f64, a: f64, b: f64) -> f64 {
    last(1.0, |x| beta_cdf(x, a, b) < p)
}

/// Probability that a number of the F distribution with these degrees of freedom is at most `x`.
pub fn f_cdf(x: f64, numerator: f64, denominator: f64) -> f64 {
    let ratio = x.max(0.0) * numerator / denominator;
    let share = if ratio.is_infinite() { 1.0 } else { ratio / (1.0 + ratio) };
    incomplete_beta([share, 1.0 / (1.0 + ratio)], [0.5 * numerator, 0.5 * denominator])
}

/// Probability that a number of the chi-squared distribution with `freedom` degrees of freedom exceeds `x`: the regularised
/// incomplete gamma function `Q(freedom / 2, x / 2)`.
///
/// Source: NIST Digital Library of Mathematical Functions, 8.7.1 (series) and 8.9.2 (continued fraction).
pub fn chi_squared_sf(x: f64, freedom: f64) -> f64 {
    let (a, x) = (0.5 * freedom, 0.5 * x);
    if x <= 0.0 {
        return 1.0;
    }
    // x^a e^-x / Gamma(a + 1)
    let factor = math::exp(-stirling_error(a) - deviance(a, x)) / (2.0 * PI * a).sqrt();
    if x < a + 1.0 {
        let (mut sum, mut term, mut n) = (1.0, 1.0, 1.0);
        while term > f64::EPSILON * sum {
            term *= x / (a + n);
            sum += term;
            n += 1.0;
        }
        return 1.0 - factor * sum;
    }
    factor * a / (x + 1.0 - a + continued(|n| [n * (a - n), x + 2.0 * n + 1.0 - a]))
}

/// `I_x(a, b)`, given `[x, 1 - x]` and `[a, b]`.
///
/// Source: NIST Digital Library of Mathematical Functions, 8.17.22 (continued fraction) and 8.17.4 (symmetry).
fn incomplete_beta([x, y]: [f64; 2], [a, b]: [f64; 2]) -> f64 {
    if x <= 0.0 || y <= 0.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    let n = a + b;
    if x > (a + 1.0) / (n + 2.0) {
        return 1.0 - incomplete_beta([y, x], [b, a]);
    }
    // x^a y^b / B(a, b), by Loader's form of the binomial probability.
    let errors = stirling_error(n) - stirling_error(a) - stirling_error(b);
    let factor = math::exp(errors - deviance(a, n * x) - deviance(b, n * y)) * (a * b / (2.0 * PI * n)).sqrt();
    let term = |k: f64| {
        let m = (0.5 * k).floor();
        let pair = (a + k - 1.0) * (a + k);
        if k % 2.0 == 0.0 { m * (b - m) * x / pair } else { -(a + m) * (n + m) * x / pair }
    };
    factor / (a * (1.0 + continued(|k| [term(k), 1.0])))
}

/// `a_1/(b_1 + a_2/(b_2 + ..))` with `[a_k, b_k] = terms(k)`.
///
/// Source: W. J. Lentz, Applied Optics 15 (1976) 668-671, as modified by I. J. Thompson and A. R. Barnett, Journal of
/// Computational Physics 64 (1986) 490-509.
fn continued(terms: impl Fn(f64) -> [f64; 2]) -> f64 {
    const SMALL: f64 = 1e-300;
    let away = |x: f64| if x.abs() < SMALL { SMALL } else { x };
    // The fraction with b_0 = 1, which is not small.
    let (mut value, mut c, mut d) = (1.0, 1.0, 0.0);
    // The root of the larger parameter counts the terms: 1e5 serve parameters up to 1e9.
    for k in 1..100_000 {
        let [a, b] = terms(f64::from(k));
        d = 1.0 / away(b + a * d);
        c = away(b + a / c);
        let change = c * d;
        value *= change;
        if (change - 1.0).abs() <= f64::EPSILON {
            break;
        }
    }
    value - 1.0
}

/// `ln Gamma(z + 1) - (z + 1/2) ln z + z - ln(2 pi)/2`: the error of Stirling's formula.
///
/// Source: C. Loader, Fast and Accurate Computation of Binomial Probabilities (2000), section 2; the series is that of the NIST
/// Digital Library of Mathematical Functions, 5.11.1.
fn stirling_error(z: f64) -> f64 {
    if z < 15.0 {
        return math::ln_gamma(z + 1.0) - (z + 0.5) * math::ln(z) + z - 0.5 * math::ln(2.0 * PI);
    }
    let square = z * z;
    let series = 1.0 / 1260.0 - (1.0 / 1680.0 - (1.0 / 1188.0 - 691.0 / 360_360.0 / square) / square) / square;
    (1.0 / 12.0 - (1.0 / 360.0 - series / square) / square) / z
}

/// `x ln(x/m) + m - x`, accurate where the two are close.
///
/// Source: C. Loader, Fast and Accurate Computation of Binomial Probabilities (2000), section 2.
fn deviance(x: f64, m: f64) -> f64 {
    let t = (m - x) / x;
    if t.abs() > 0.1 {
        return x * (t - math::ln_1p(t));
    }
    // ln(1 + t) = 2 (v + v^3/3 + v^5/5 + ..)
    let v = t / (2.0 + t);
    let (mut sum, mut power, mut k) = (t * v, 2.0 * v, 3.0);
    loop {
        power *= v * v;
        let next = sum - power / k;
        if next == sum {
            return x * sum;
        }
        (sum, k) = (next, k + 2.0);
    }
}

/// The last number from 0 to `high` for which `holds`, where it holds below and not above.
fn last(high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0, high.to_bits());
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if holds(f64::from_bits(middle)) {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::from_bits(low)
}
