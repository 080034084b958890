//! Distribution functions and quantiles based on [`mops_math`], hence bit-identical on every machine.

use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};

use mops_math as math;

/// Returns the cumulative distribution function of the standard normal distribution at `x`.
pub fn normal_cdf(x: f64) -> f64 {
    0.5 * math::erfc(-x * FRAC_1_SQRT_2)
}

/// Returns the `p` quantile of the standard normal distribution; infinite for 0 and 1.
pub fn normal_quantile(p: f64) -> f64 {
    if p > 0.5 {
        return -normal_quantile(1.0 - p);
    }
    if p <= 0.0 {
        return f64::NEG_INFINITY;
    }
    -SQRT_2 * last(f64::INFINITY, |z| 0.5 * math::erfc(z) > p)
}

/// Returns the cumulative distribution function of the beta distribution at `x`: the regularised incomplete beta
/// function `I_x(a, b)`.
pub fn beta_cdf(x: f64, a: f64, b: f64) -> f64 {
    incomplete_beta([x, 1.0 - x], [a, b])
}

/// Returns the `p` quantile of the beta distribution.
pub fn beta_quantile(p: f64, a: f64, b: f64) -> f64 {
    last(1.0, |x| beta_cdf(x, a, b) < p)
}

/// Returns the cumulative distribution function of the F distribution with these degrees of freedom at `x`.
pub fn f_cdf(x: f64, numerator: f64, denominator: f64) -> f64 {
    let ratio = x.max(0.0) * numerator / denominator;
    let share = if ratio.is_infinite() { 1.0 } else { ratio / (1.0 + ratio) };
    incomplete_beta([share, 1.0 / (1.0 + ratio)], [0.5 * numerator, 0.5 * denominator])
}

/// Returns the probability that a chi-squared variable with `freedom` degrees of freedom exceeds `x`: the regularised
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
    factor * a / continued(x + 1.0 - a, |n| [n * (a - n), x + 2.0 * n + 1.0 - a])
}

/// Returns `I_x(a, b)`, given `[x, 1 - x]` and `[a, b]`.
///
/// Source: A. R. DiDonato, A. H. Morris, ACM Transactions on Mathematical Software 18 (1992) 360-373, section 4
/// (continued fraction); NIST Digital Library of Mathematical Functions, 8.17.4 (symmetry).
fn incomplete_beta([x, y]: [f64; 2], [a, b]: [f64; 2]) -> f64 {
    if x <= 0.0 || y <= 0.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    let n = a + b;
    if x > (a + 1.0) / (n + 2.0) {
        return 1.0 - incomplete_beta([y, x], [b, a]);
    }
    // x^a y^b / B(a, b), in Loader's form of the binomial probability.
    let errors = stirling_error(n) - stirling_error(a) - stirling_error(b);
    let factor = math::exp(errors - deviance(a, n * x) - deviance(b, n * y)) * (a * b / (2.0 * PI * n)).sqrt();
    // a - (a + b) x, without cancellation for small x or y.
    let distance = a * y - b * x;
    let odd = |m: f64| a + 2.0 * m + 1.0;
    let numerator = |m: f64| (a + m - 1.0) * (n + m - 1.0) * m * (b - m) * math::powi(x / odd(m - 1.0), 2);
    let rest = |m: f64| (a + m) * (distance + 1.0 + m * (1.0 + y)) / odd(m);
    factor / continued(rest(0.0), |m| [numerator(m), m + m * (b - m) * x / odd(m - 1.0) + rest(m)])
}

/// Evaluates the continued fraction `b_0 + a_1/(b_1 + a_2/(b_2 + ..))` with `[a_k, b_k] = terms(k)`.
///
/// Source: W. J. Lentz, Applied Optics 15 (1976) 668-671, as modified by I. J. Thompson and A. R. Barnett, Journal of
/// Computational Physics 64 (1986) 490-509.
fn continued(first: f64, terms: impl Fn(f64) -> [f64; 2]) -> f64 {
    const SMALL: f64 = 1e-300;
    let away = |x: f64| if x.abs() < SMALL { SMALL } else { x };
    let (mut value, mut d) = (away(first), 0.0);
    let mut c = value;
    // The number of terms grows with the root of the larger parameter: 1e5 terms suffice for parameters up to 1e9.
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
    value
}

/// Returns `ln Gamma(z + 1) - (z + 1/2) ln z + z - ln(2 pi)/2`: the error of Stirling's formula.
///
/// Source: C. Loader, Fast and Accurate Computation of Binomial Probabilities (2000), section 2; the series is that of
/// the NIST Digital Library of Mathematical Functions, 5.11.1.
fn stirling_error(z: f64) -> f64 {
    if z < 15.0 {
        return math::ln_gamma(z + 1.0) - (z + 0.5) * math::ln(z) + z - 0.5 * math::ln(2.0 * PI);
    }
    let square = z * z;
    let series = 1.0 / 1260.0 - (1.0 / 1680.0 - (1.0 / 1188.0 - 691.0 / 360_360.0 / square) / square) / square;
    (1.0 / 12.0 - (1.0 / 360.0 - series / square) / square) / z
}

/// Returns `x ln(x/m) + m - x`, accurate if both are close.
///
/// Source: C. Loader, Fast and Accurate Computation of Binomial Probabilities (2000), section 2.
fn deviance(x: f64, m: f64) -> f64 {
    let t = (m - x) / x;
    if t.abs() > 0.1 {
        return x * math::ln(x / m) + m - x;
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

/// Returns the largest number from 0 to `high` for which the monotone predicate `holds` is true.
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

#[cfg(test)]
mod tests {
    use super::super::t_quantile;
    use super::*;

    /// Asserts agreement with values from mpmath with 40 digits.
    fn assert_near(found: f64, exact: f64, what: &str) {
        assert!((found / exact - 1.0).abs() < 1e-13, "{what}: {found}, not {exact}");
    }

    #[test]
    fn the_normal_distribution_and_its_quantiles_are_the_published_ones() {
        for (x, exact) in [
            (-8.0, 6.220_960_574_271_784e-16),
            (-1.5, 0.066_807_201_268_858_07),
            (0.3, 0.617_911_422_188_952_6),
            (2.0, 0.977_249_868_051_820_8),
            (5.0, 0.999_999_713_348_428_1),
        ] {
            assert_near(normal_cdf(x), exact, &format!("normal up to {x}"));
        }
        for (p, exact) in [
            (0.975, 1.959_963_984_540_053_9),
            (0.1, -1.281_551_565_544_600_4),
            (0.3, -0.524_400_512_708_040_8),
            (1e-10, -6.361_340_902_404_056),
            (1e-300, -37.047_096_299_361_2),
        ] {
            assert_near(normal_quantile(p), exact, &format!("normal quantile {p}"));
        }
        // 1 - p is accurate to a relative 1e-10.
        assert!((normal_quantile(0.999_999) - 4.753_424_308_817_088).abs() < 1e-10);
        assert_eq!([0.0, 0.5, 1.0].map(normal_quantile), [f64::NEG_INFINITY, 0.0, f64::INFINITY]);
    }

    #[test]
    fn the_incomplete_beta_function_is_that_of_many_digits() {
        for (x, a, b, exact) in [
            (0.3, 2.0, 5.0, 0.579_825),
            (0.001, 0.5, 0.5, 0.020_135_041_633_377_49),
            (0.999, 0.5, 3.5, 0.999_999_999_990_793_4),
            (0.5, 1000.0, 1010.0, 0.588_269_827_543_727_5),
            (1e-9, 0.25, 40.0, 0.015_565_889_120_528_657),
            (0.37, 300.0, 500.0, 0.387_260_470_159_762_3),
            (0.9, 26.0, 38.0, 1.0),
            (0.02, 1.0, 250.0, 0.993_595_003_111_205_1),
        ] {
            assert_near(beta_cdf(x, a, b), exact, &format!("beta({a}, {b}) up to {x}"));
        }
        assert_eq!([beta_cdf(0.0, 2.0, 3.0), beta_cdf(1.0, 2.0, 3.0)], [0.0, 1.0]);
    }

    #[test]
    fn quantiles_of_student_are_those_of_many_digits() {
        for (p, freedom, exact) in [
            (0.975, 10.0, 2.228_138_851_986_274),
            (0.975, 1.0, 12.706_204_736_174_693),
            (0.9995, 2.5, 18.277_893_528_131_46),
            (0.6, 3.0, 0.276_670_662_332_689_85),
            (0.975, 1e6, 1.959_966_356_814_106_7),
            (0.025, 37.0, -2.026_192_463_029_11),
            (0.999, 250.5, 3.123_083_887_658_548_7),
        ] {
            assert_near(t_quantile(p, freedom), exact, &format!("t({freedom}) of {p}"));
        }
    }

    /// Checks against 40 digits; with 1 and 2 degrees of freedom `sqrt(x/(x + 2))`.
    #[test]
    fn the_f_distribution_is_that_of_many_digits() {
        for (x, numerator, denominator, exact) in [
            (2.5, 3.0, 40.0, 0.926_745_647_982_050_1),
            (0.2, 10.0, 7.0, 0.011_461_207_045_411_08),
            (1.02, 500.0, 900.0, 0.602_066_664_761_040_3),
            (40.0, 1.0, 2.0, f64::sqrt(40.0 / 42.0)),
            (f64::INFINITY, 3.0, 4.0, 1.0),
        ] {
            assert_near(f_cdf(x, numerator, denominator), exact, &format!("F({numerator}, {denominator}) up to {x}"));
        }
        assert_eq!(f_cdf(0.0, 3.0, 4.0), 0.0);
    }

    /// Checks against 40 digits; with 2 degrees of freedom `exp(-x/2)`.
    #[test]
    fn the_chi_squared_distribution_is_that_of_many_digits() {
        for (x, freedom, exact) in [
            (3.84, 1.0, 0.050_043_521_248_705_1),
            (0.1, 3.0, 0.991_837_423_731_876_5),
            (30.0, 10.0, 0.000_856_641_210_775_300_4),
            (200.0, 180.0, 0.146_346_174_698_732_8),
            (1e-6, 2.0, math::exp(-5e-7)),
            (50.0, 2.0, math::exp(-25.0)),
            (700.0, 5.0, 4.911_986_103_573_201e-149),
            (9900.0, 10_000.0, 0.759_520_085_683_979_3),
        ] {
            assert_near(chi_squared_sf(x, freedom), exact, &format!("chi-squared({freedom}) from {x}"));
        }
        assert_eq!([chi_squared_sf(0.0, 4.0), chi_squared_sf(-1.0, 4.0)], [1.0, 1.0]);
    }
}
