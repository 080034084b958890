//! Transformations shared by the functions.

use mops_language::Scalar;
use mops_math as math;

use super::instance::Matrix;

/// `z - shift`.
pub(crate) fn shifted<S: Scalar>(z: &[S], shift: &[f64]) -> Vec<S> {
    z.iter().zip(shift).map(|(z, s)| *z - *s).collect()
}

/// `R z`.
pub(crate) fn rotated<S: Scalar>(r: &Matrix, z: &[S]) -> Vec<S> {
    let row = |row: &Vec<f64>| row.iter().zip(z).fold(S::from(0.0), |sum, (r, z)| sum + *z * *r);
    r.iter().map(row).collect()
}

/// Relative position of coordinate `i` of `n`, from 0 to 1.
#[allow(clippy::cast_precision_loss)]
pub(crate) fn share(i: usize, n: usize) -> f64 {
    i as f64 / (n.max(2) - 1) as f64
}

/// `Lambda^alpha z`: coordinate `i` times `alpha^(i / (2 (n - 1)))`.
pub(crate) fn conditioned<S: Scalar>(z: &[S], alpha: f64) -> Vec<S> {
    let n = z.len();
    z.iter().enumerate().map(|(i, z)| *z * math::powf(alpha, 0.5 * share(i, n))).collect()
}

/// `T_osz` of a number: smooth, small, self-similar oscillations.
pub(crate) fn wavy<S: Scalar>(x: S) -> S {
    let value = x.value();
    if value == 0.0 {
        return x;
    }
    let (c1, c2) = if value > 0.0 { (10.0, 7.9) } else { (5.5, 3.1) };
    let log = x.abs().ln();
    let size = (log + ((log * c1).sin() + (log * c2).sin()) * 0.049).exp();
    if value > 0.0 { size } else { -size }
}

/// `T_osz` of every coordinate.
pub(crate) fn oscillated<S: Scalar>(z: &[S]) -> Vec<S> {
    z.iter().map(|z| wavy(*z)).collect()
}

/// `T_asy^beta`: positive coordinates to the power `1 + beta i / (n - 1) sqrt(z_i)`.
pub(crate) fn asymmetric<S: Scalar>(z: &[S], beta: f64) -> Vec<S> {
    let n = z.len();
    let of = |(i, z): (usize, &S)| {
        if z.value() > 0.0 { ((z.sqrt() * (beta * share(i, n)) + 1.0) * z.ln()).exp() } else { *z }
    };
    z.iter().enumerate().map(of).collect()
}

/// Squared distance of the point to [-5, 5]^n.
pub(crate) fn outside<S: Scalar>(x: &[S]) -> S {
    let beyond = x.iter().map(|x| x.abs() - 5.0).filter(|d| d.value() > 0.0);
    beyond.fold(S::from(0.0), |sum, d| sum + d * d)
}

/// Sum over the coordinates.
pub(crate) fn sum<S: Scalar>(terms: impl Iterator<Item = S>) -> S {
    terms.fold(S::from(0.0), |sum, term| sum + term)
}

/// Nearest integer, halves upwards, as a constant.
pub(crate) fn rounded<S: Scalar>(x: S) -> S {
    S::from((x.value() + 0.5).floor())
}
