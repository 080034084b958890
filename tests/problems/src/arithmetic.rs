//! Short names for what formulas of test problems are made of.

use mops_core::Scalar;

/// A constant.
pub(crate) fn c<S: Scalar>(value: f64) -> S {
    S::from(value)
}

/// Square.
pub(crate) fn sq<S: Scalar>(x: S) -> S {
    x * x
}

/// Cube.
pub(crate) fn cube<S: Scalar>(x: S) -> S {
    x * x * x
}

/// Fourth power.
pub(crate) fn fourth<S: Scalar>(x: S) -> S {
    sq(sq(x))
}

/// Sum.
pub(crate) fn sum<S: Scalar>(terms: impl IntoIterator<Item = S>) -> S {
    terms.into_iter().fold(c(0.0), |sum, term| sum + term)
}

/// Inner product with constants; what has none counts nothing.
pub(crate) fn dot<S: Scalar>(coefficients: &[f64], x: &[S]) -> S {
    sum(coefficients.iter().zip(x).map(|(&a, &x)| x * a))
}

/// Arc tangent.
pub(crate) fn atan<S: Scalar>(x: S) -> S {
    x.chain(x.value().atan(), 1.0 / (1.0 + x.value().powi(2)))
}

/// Hyperbolic sine.
pub(crate) fn sinh<S: Scalar>(x: S) -> S {
    x.chain(x.value().sinh(), x.value().cosh())
}

/// A power with an exponent that varies, of a positive number.
pub(crate) fn power<S: Scalar>(x: S, exponent: S) -> S {
    (x.ln() * exponent).exp()
}

/// Rows of an exact penalty function: the objective, and the objective plus `weight` times each constraint.
///
/// Source: A. R. Conn, A. Wright; L. Luksan, J. Vlcek, report V-798 (2000), section 2.
pub(crate) fn penalised<S: Scalar>(weight: f64, outputs: &[S]) -> Vec<S> {
    let (&f, constraints) = outputs.split_first().expect("there is an objective");
    std::iter::once(f).chain(constraints.iter().map(|&g| f + g * weight)).collect()
}
