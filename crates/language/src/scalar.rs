//! Scalar types of model equations: `f64`, and dual numbers with derivatives.

use mops_math as math;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// Scalar type of model equations. Equations generic over `Scalar` run with values and with exact tangents.
///
/// Comparisons and step-size control use [`Scalar::value`] alone, so that computing tangents changes no value.
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// Number of tangents.
    const DIRECTIONS: usize;

    /// Returns the value without tangents.
    fn value(self) -> f64;
    /// Returns the tangents, [`Scalar::DIRECTIONS`] of them.
    fn tangents(&self) -> &[f64];
    /// Sets one tangent.
    fn set_tangent(&mut self, direction: usize, tangent: f64);
    /// Returns `f(self)`, given the value and the derivative of `f` at [`Scalar::value`] (chain rule).
    #[must_use]
    fn chain(self, value: f64, derivative: f64) -> Self;

    /// Returns the sine of an angle in rad.
    #[must_use]
    fn sin(self) -> Self {
        let (sin, cos) = math::sin_cos(self.value());
        self.chain(sin, cos)
    }
    /// Returns the cosine of an angle in rad.
    #[must_use]
    fn cos(self) -> Self {
        let (sin, cos) = math::sin_cos(self.value());
        self.chain(cos, -sin)
    }
    /// Returns the sine and the cosine of an angle in rad.
    #[must_use]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = math::sin_cos(self.value());
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
    /// Returns the exponential.
    #[must_use]
    fn exp(self) -> Self {
        let e = math::exp(self.value());
        self.chain(e, e)
    }
    /// Returns the natural logarithm.
    #[must_use]
    fn ln(self) -> Self {
        self.chain(math::ln(self.value()), 1.0 / self.value())
    }
    /// Returns the square root.
    #[must_use]
    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        self.chain(root, 0.5 / root)
    }
    /// Returns the hyperbolic tangent.
    #[must_use]
    fn tanh(self) -> Self {
        let t = math::tanh(self.value());
        self.chain(t, 1.0 - t * t)
    }
    /// Returns the power with a constant exponent.
    #[must_use]
    fn powf(self, exponent: f64) -> Self {
        self.chain(math::powf(self.value(), exponent), exponent * math::powf(self.value(), exponent - 1.0))
    }
    /// Returns the absolute value; its derivative at 0 is defined as 0.
    #[must_use]
    fn abs(self) -> Self {
        let x = self.value();
        self.chain(x.abs(), if x == 0.0 { 0.0 } else { x.signum() })
    }
}

impl Scalar for f64 {
    const DIRECTIONS: usize = 0;

    #[inline]
    fn value(self) -> f64 {
        self
    }
    #[inline]
    fn tangents(&self) -> &[f64] {
        &[]
    }
    #[inline]
    fn set_tangent(&mut self, _: usize, _: f64) {}
    #[inline]
    fn chain(self, value: f64, _: f64) -> f64 {
        value
    }

    // The default implementations would compute unused derivatives.
    #[inline]
    fn sin(self) -> f64 {
        math::sin(self)
    }
    #[inline]
    fn cos(self) -> f64 {
        math::cos(self)
    }
    #[inline]
    fn powf(self, exponent: f64) -> f64 {
        math::powf(self, exponent)
    }
}

/// Number of directions per simulation, a compromise between many and few tuners. Value and tangents are eight numbers,
/// which fill the vector registers of processors. Only one width is used, because every width is compiled for every
/// model and compilation takes long.
pub const DIRECTIONS: usize = 7;

/// Dual number with the tangents of one simulation.
pub type Dual7 = Dual<DIRECTIONS>;

/// A dual number: a value with its derivatives with respect to `N` quantities (forward differentiation).
///
/// Source: A. Griewank, A. Walther, Evaluating Derivatives, 2nd edition (SIAM 2008), chapter 3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// Value.
    pub value: f64,
    /// Derivatives.
    pub tangent: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// Creates the `index`-th of the `N` quantities: tangent 1 in its own direction.
    pub fn variable(value: f64, index: usize) -> Self {
        let mut tangent = [0.0; N];
        tangent[index] = 1.0;
        Self { value, tangent }
    }

    #[inline]
    fn combine(self, other: Self, value: f64, da: f64, db: f64) -> Self {
        let mut tangent = [0.0; N];
        for i in 0..N {
            tangent[i] = da * self.tangent[i] + db * other.tangent[i];
        }
        Self { value, tangent }
    }
}

impl<const N: usize> Scalar for Dual<N> {
    const DIRECTIONS: usize = N;

    #[inline]
    fn value(self) -> f64 {
        self.value
    }
    #[inline]
    fn tangents(&self) -> &[f64] {
        &self.tangent
    }
    #[inline]
    fn set_tangent(&mut self, direction: usize, tangent: f64) {
        self.tangent[direction] = tangent;
    }
    #[inline]
    fn chain(self, value: f64, derivative: f64) -> Self {
        // A loop, as the compiler does not inline `map` over arrays.
        let mut tangent = self.tangent;
        for t in &mut tangent {
            *t *= derivative;
        }
        Self { value, tangent }
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    #[inline]
    fn from(value: f64) -> Self {
        Self { value, tangent: [0.0; N] }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        self.combine(o, self.value + o.value, 1.0, 1.0)
    }
}
impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        self.combine(o, self.value - o.value, 1.0, -1.0)
    }
}
impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        self.combine(o, self.value * o.value, o.value, self.value)
    }
}
impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        let quotient = self.value / o.value;
        self.combine(o, quotient, 1.0 / o.value, -quotient / o.value)
    }
}
impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}
impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(self, o: f64) -> Self {
        Self { value: self.value + o, ..self }
    }
}
impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(self, o: f64) -> Self {
        Self { value: self.value - o, ..self }
    }
}
impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, o: f64) -> Self {
        self.chain(self.value * o, o)
    }
}
impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn div(self, o: f64) -> Self {
        self.chain(self.value / o, 1.0 / o)
    }
}
impl<const N: usize> AddAssign for Dual<N> {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
impl<const N: usize> SubAssign for Dual<N> {
    #[inline]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}
impl<const N: usize> MulAssign for Dual<N> {
    #[inline]
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An expression that uses every operation.
    fn all<S: Scalar>(x: S, y: S) -> S {
        let (sin, cos) = (x * 2.0).sin_cos();
        let mut z = sin * cos / (y + 3.0) - (-x).exp() + (y * y + 1.0).sqrt() - y.ln() / 2.0;
        z += x.tanh() - 1.0;
        z -= y.powf(1.5).abs();
        z *= x.sin() + y.cos();
        z
    }

    #[test]
    fn tangents_agree_with_central_differences() {
        let (x, y, h) = (0.7, 1.3, 1e-6);
        let exact = all(Dual::<2>::variable(x, 0), Dual::<2>::variable(y, 1));
        let dx = (all(x + h, y) - all(x - h, y)) / (2.0 * h);
        let dy = (all(x, y + h) - all(x, y - h)) / (2.0 * h);
        assert_eq!(exact.value, all(x, y), "tangents change no value");
        assert!((exact.tangent[0] - dx).abs() < 1e-8, "{exact:?} {dx}");
        assert!((exact.tangent[1] - dy).abs() < 1e-8, "{exact:?} {dy}");
    }
}
