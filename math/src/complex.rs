//! What complex numbers need of the functions of real ones.

use nalgebra::Complex;

/// Absolute value `|z|`.
#[inline]
#[must_use]
pub fn norm(z: Complex<f64>) -> f64 {
    super::hypot(z.re, z.im)
}

/// Angle of `z` in rad, from -pi to pi.
#[inline]
#[must_use]
pub fn arg(z: Complex<f64>) -> f64 {
    super::atan2(z.im, z.re)
}

/// The number of absolute value `norm` at the angle `arg`, rad.
#[inline]
#[must_use]
pub fn from_polar(norm: f64, arg: f64) -> Complex<f64> {
    let (sin, cos) = super::sin_cos(arg);
    Complex::new(norm * cos, norm * sin)
}

/// Exponential, `e^z`.
#[inline]
#[must_use]
pub fn exp(z: Complex<f64>) -> Complex<f64> {
    from_polar(super::exp(z.re), z.im)
}

/// Square root with a real part that is not negative.
#[inline]
#[must_use]
pub fn sqrt(z: Complex<f64>) -> Complex<f64> {
    from_polar(norm(z).sqrt(), 0.5 * arg(z))
}
