//! Functions of complex numbers, based on those of real numbers.

use nalgebra::Complex;

/// Returns the absolute value `|z|`.
#[inline]
#[must_use]
pub fn norm(z: Complex<f64>) -> f64 {
    super::hypot(z.re, z.im)
}

/// Returns the angle of `z` in rad, from -pi to pi.
#[inline]
#[must_use]
pub fn arg(z: Complex<f64>) -> f64 {
    super::atan2(z.im, z.re)
}

/// Returns the number with absolute value `norm` and angle `arg`, rad.
#[inline]
#[must_use]
pub fn from_polar(norm: f64, arg: f64) -> Complex<f64> {
    let (sin, cos) = super::sin_cos(arg);
    Complex::new(norm * cos, norm * sin)
}

/// Returns the exponential `e^z`.
#[inline]
#[must_use]
pub fn exp(z: Complex<f64>) -> Complex<f64> {
    from_polar(super::exp(z.re), z.im)
}

/// Returns the square root with a nonnegative real part.
#[inline]
#[must_use]
pub fn sqrt(z: Complex<f64>) -> Complex<f64> {
    from_polar(norm(z).sqrt(), 0.5 * arg(z))
}
