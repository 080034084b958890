//! Numbers with twice the digits of `f64`, and what the algorithms for eigenvalues need of a number.
//!
//! Multiple poles move by a root of the rounding error, and cancellation in badly scaled coordinates costs further
//! digits. With about 32 digits both are far below the rounding of the given matrices.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use nalgebra::DMatrix;

use super::Complex;

/// Entry of a matrix: its magnitude decides on what is negligible.
pub(super) trait Entry: Copy + Debug + PartialEq + Sub<Output = Self> + 'static {
    /// Distance from 1 to the next number.
    const EPSILON: f64;
    /// Number 0.
    const ZERO: Self;

    /// Returns the magnitude; of a complex number, the sum of those of its parts.
    fn size(self) -> f64;
}

/// Real number.
pub(super) trait Real:
    Entry
    + PartialOrd
    + From<f64>
    + Add<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// Returns the nearest `f64`.
    fn value(self) -> f64;

    /// Returns the square root of a number that is not negative.
    fn sqrt(self) -> Self;

    /// Returns the product with a power of two.
    fn scaled(self, power: f64) -> Self;

    /// Returns the magnitude.
    fn abs(self) -> Self {
        if self < Self::ZERO { -self } else { self }
    }
}

impl Entry for f64 {
    const EPSILON: f64 = Self::EPSILON;
    const ZERO: Self = 0.0;

    fn size(self) -> f64 {
        self.abs()
    }
}

impl Entry for Complex {
    const EPSILON: f64 = f64::EPSILON;
    const ZERO: Self = Self::new(0.0, 0.0);

    fn size(self) -> f64 {
        self.re.abs() + self.im.abs()
    }
}

impl Real for f64 {
    fn value(self) -> f64 {
        self
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }

    fn scaled(self, power: f64) -> Self {
        self * power
    }
}

/// Number as a sum of two `f64`, the second at most half a unit in the last place of the first.
///
/// Source: D. E. Knuth, The Art of Computer Programming 2, 3rd edition (1997), section 4.2.2; T. J. Dekker, A
/// floating-point technique for extending the available precision, Numerische Mathematik 18 (1971) 224-242; Y. Hida, X.
/// S. Li, D. H. Bailey, Library for double-double and quad-double arithmetic (2007).
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub(super) struct Extended {
    high: f64,
    low: f64,
}

/// Returns the sum of two numbers, the first the larger one.
#[inline]
fn ordered_sum(a: f64, b: f64) -> Extended {
    let high = a + b;
    Extended { high, low: b - (high - a) }
}

#[inline]
fn exact_sum(a: f64, b: f64) -> Extended {
    let high = a + b;
    let part = high - a;
    Extended { high, low: (a - (high - part)) + (b - part) }
}

/// Returns the upper and the lower half of the digits.
#[inline]
fn halves(x: f64) -> [f64; 2] {
    let t = 134_217_729.0 * x; // 2^27 + 1
    let high = t - (t - x);
    [high, x - high]
}

#[inline]
fn exact_product(a: f64, b: f64) -> Extended {
    let high = a * b;
    let ([a1, a2], [b1, b2]) = (halves(a), halves(b));
    Extended { high, low: ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2 }
}

impl From<f64> for Extended {
    #[inline]
    fn from(x: f64) -> Self {
        Self { high: x, low: 0.0 }
    }
}

impl Add for Extended {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        let (high, low) = (exact_sum(self.high, other.high), exact_sum(self.low, other.low));
        let first = ordered_sum(high.high, high.low + low.high);
        ordered_sum(first.high, first.low + low.low)
    }
}

impl Neg for Extended {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Sub for Extended {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Extended {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let product = exact_product(self.high, other.high);
        ordered_sum(product.high, product.low + (self.high * other.low + self.low * other.high))
    }
}

impl Div for Extended {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * Self::from(first);
        let second = rest.high / other.high;
        let rest = rest - other * Self::from(second);
        ordered_sum(first, second) + Self::from(rest.high / other.high)
    }
}

impl AddAssign for Extended {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Extended {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Entry for Extended {
    const EPSILON: f64 = f64::EPSILON * f64::EPSILON;
    const ZERO: Self = Self { high: 0.0, low: 0.0 };

    #[inline]
    fn size(self) -> f64 {
        self.high.abs()
    }
}

impl Real for Extended {
    fn value(self) -> f64 {
        self.high
    }

    fn sqrt(self) -> Self {
        if self.high <= 0.0 {
            return Self::ZERO;
        }
        let root = self.high.sqrt();
        Self::from(root) + Self::from((self - exact_product(root, root)).high / (2.0 * root))
    }

    fn scaled(self, power: f64) -> Self {
        Self { high: self.high * power, low: self.low * power }
    }
}

/// Returns a matrix with twice the digits.
pub(super) fn extended(m: &DMatrix<f64>) -> DMatrix<Extended> {
    m.map(Extended::from)
}

/// Returns the nearest matrix of `f64`.
pub(super) fn rounded<T: Real>(m: &DMatrix<T>) -> DMatrix<f64> {
    m.map(T::value)
}

/// Returns the product of two matrices.
pub(super) fn product<T: Real>(a: &DMatrix<T>, b: &DMatrix<T>) -> DMatrix<T> {
    let entry = |i: usize, j: usize| {
        let terms = (0..a.ncols()).filter(|&k| a[(i, k)] != T::ZERO && b[(k, j)] != T::ZERO);
        terms.fold(T::ZERO, |sum, k| sum + a[(i, k)] * b[(k, j)])
    };
    DMatrix::from_fn(a.nrows(), b.ncols(), entry)
}

/// Returns the sum of two matrices.
pub(super) fn sum<T: Real>(a: &DMatrix<T>, b: &DMatrix<T>) -> DMatrix<T> {
    a.zip_map(b, |a, b| a + b)
}

/// Returns `m^-1 right`, by elimination with partial pivoting; `None` if a pivot is 0.
pub(super) fn solved<T: Real>(mut m: DMatrix<T>, mut right: DMatrix<T>) -> Option<DMatrix<T>> {
    let n = m.nrows();
    for k in 0..n {
        let pivot = (k..n).fold(k, |best, i| if m[(i, k)].size() > m[(best, k)].size() { i } else { best });
        if m[(pivot, k)] == T::ZERO || !m[(pivot, k)].size().is_finite() {
            return None;
        }
        m.swap_rows(k, pivot);
        right.swap_rows(k, pivot);
        for i in (k + 1..n).filter(|&i| i != k) {
            if m[(i, k)] == T::ZERO {
                continue;
            }
            let factor = m[(i, k)] / m[(k, k)];
            (k + 1..n).for_each(|j| {
                let above = m[(k, j)];
                m[(i, j)] -= factor * above;
            });
            (0..right.ncols()).for_each(|j| {
                let above = right[(k, j)];
                right[(i, j)] -= factor * above;
            });
        }
    }
    for j in 0..right.ncols() {
        for i in (0..n).rev() {
            let sum = (i + 1..n).fold(right[(i, j)], |sum, k| sum - m[(i, k)] * right[(k, j)]);
            right[(i, j)] = sum / m[(i, i)];
        }
    }
    Some(right)
}

/// Returns the Euclidean norm of the entries.
pub(super) fn norm<T: Real>(m: &DMatrix<T>) -> f64 {
    m.iter().map(|x| x.size() * x.size()).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math as math;

    #[test]
    fn sums_products_quotients_and_roots_keep_thirty_digits() {
        let (one, three) = (Extended::from(1.0), Extended::from(3.0));
        assert!((one / three * three - one).size() < 1e-31);
        let root = Extended::from(2.0).sqrt();
        assert!((root * root - Extended::from(2.0)).size() < 1e-31);
        // 1 + 2^-80 - 1, and the square of 1 + 2^-60.
        let tiny = math::powi(2.0, -80);
        assert_eq!((one + Extended::from(tiny) - one).value(), tiny);
        let near = one + Extended::from(math::powi(2.0, -60));
        assert!((near * near - one - Extended::from(math::powi(2.0, -59))).size() <= math::powi(2.0, -104));
    }

    #[test]
    fn a_hilbert_matrix_is_solved_to_all_digits() {
        // The inverse of the Hilbert matrix of order 8 is one of integers; its first entry is 64. The condition is
        // 1.5e10.
        let n = 8;
        let hilbert = DMatrix::from_fn(n, n, |i, j| Extended::from(1.0) / Extended::from((i + j + 1) as f64));
        let inverse = solved(hilbert, extended(&DMatrix::identity(n, n))).unwrap();
        assert!((inverse[(0, 0)] - Extended::from(64.0)).size() < 1e-17, "{:?}", inverse[(0, 0)]);
        assert!(solved(extended(&DMatrix::zeros(2, 2)), extended(&DMatrix::identity(2, 2))).is_none());
    }
}
