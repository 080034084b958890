//! Short names for arithmetic in the formulas of test problems.

use mops_language::Scalar;
use mops_math as math;

/// Returns a constant.
pub(crate) fn c<S: Scalar>(value: f64) -> S {
    S::from(value)
}

/// Returns the square.
pub(crate) fn sq<S: Scalar>(x: S) -> S {
    x * x
}

/// Returns the cube.
pub(crate) fn cube<S: Scalar>(x: S) -> S {
    x * x * x
}

/// Returns the fourth power.
pub(crate) fn fourth<S: Scalar>(x: S) -> S {
    sq(sq(x))
}

/// Returns the sum.
pub(crate) fn sum<S: Scalar>(terms: impl IntoIterator<Item = S>) -> S {
    terms.into_iter().fold(c(0.0), |sum, term| sum + term)
}

/// Returns the inner product with constants; variables without a constant do not count.
pub(crate) fn dot<S: Scalar>(coefficients: &[f64], x: &[S]) -> S {
    sum(coefficients.iter().zip(x).map(|(&a, &x)| x * a))
}

/// Returns the arc tangent.
pub(crate) fn atan<S: Scalar>(x: S) -> S {
    x.chain(math::atan(x.value()), 1.0 / (1.0 + math::powi(x.value(), 2)))
}

/// Returns the hyperbolic sine.
pub(crate) fn sinh<S: Scalar>(x: S) -> S {
    x.chain(math::sinh(x.value()), math::cosh(x.value()))
}

/// Returns the power of a positive number with a variable exponent.
pub(crate) fn power<S: Scalar>(x: S, exponent: S) -> S {
    (x.ln() * exponent).exp()
}

/// Returns the criteria of an exact penalty function: the objective, and the objective plus `weight` times each
/// constraint.
///
/// Source: A. R. Conn, A. Wright; L. Luksan, J. Vlcek, report V-798 (2000), section 2.
pub(crate) fn penalised<S: Scalar>(weight: f64, outputs: &[S]) -> Vec<S> {
    let (&f, constraints) = outputs.split_first().expect("there is an objective");
    std::iter::once(f).chain(constraints.iter().map(|&g| f + g * weight)).collect()
}

/// Returns the standard normal distribution function: a series near 0, a continued fraction elsewhere.
///
/// Source: NIST Handbook of Mathematical Functions (2010), equations 7.6.2 and 7.9.2.
pub(crate) fn normal<S: Scalar>(x: S) -> S {
    let z = x.value();
    let density = math::exp(-0.5 * z * z) / std::f64::consts::TAU.sqrt();
    let tail = |z: f64| (1..120).rev().fold(z, |fraction, k| z + f64::from(k) / fraction);
    let value = if z.abs() < 3.0 {
        let terms = (1..80).scan(z, |term, k| {
            let this = *term;
            *term *= z * z / f64::from(2 * k + 1);
            Some(this)
        });
        let series: f64 = terms.sum();
        0.5 + density * series
    } else if z > 0.0 {
        1.0 - density / tail(z)
    } else {
        density / tail(-z)
    };
    x.chain(value, density)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_distribution_function_has_its_known_values() {
        // M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions (1964), table 26.1; continuous at 3.
        let known = [(0.0, 0.5), (1.0, 0.841344746068543), (-2.0, 0.022750131948179), (-4.0, 0.0000316712418331)];
        for (z, p) in known {
            assert!((normal(z) - p).abs() < 1e-15, "{z} {}", normal(z));
        }
        assert!((normal(3.0 - 1e-12) - normal(3.0_f64)).abs() < 1e-13);
    }
}
