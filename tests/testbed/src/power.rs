//! Integer powers by products, as `f64::powi` has no bits of its own: every compiler may multiply in another order.

/// `x^n`, the factors one after the other; for negative `n` its reciprocal.
pub fn powi(x: f64, n: i32) -> f64 {
    let power = (0..n.unsigned_abs()).fold(1.0, |power, _| power * x);
    if n < 0 { 1.0 / power } else { power }
}
