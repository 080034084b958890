//! Intervals: sets of numbers between two bounds, with the operations of expressions.

use mops_math as math;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Closed interval of numbers from `low` to `high`; the bounds may be infinite.
///
/// Every operation encloses the set of its results up to rounding. Bounds are not rounded outwards, because values, not
/// bounds, locate the zeros.
///
/// Source: R. Moore, R. Kearfott, M. Cloud, Introduction to Interval Analysis (SIAM 2009), chapters 2 and 5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
}

impl Interval {
    /// Interval of all numbers.
    pub const ALL: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// Interval that contains only 0.
    pub const ZERO: Self = Self { low: 0.0, high: 0.0 };

    /// Returns the interval between two bounds in any order; all numbers if a bound is NaN.
    #[must_use]
    #[inline]
    pub fn between(a: f64, b: f64) -> Self {
        if a <= b { Self { low: a, high: b } } else { Self::ordered(b, a) }
    }

    /// Returns the interval between two ordered bounds; all numbers if a bound is NaN.
    #[inline]
    fn ordered(low: f64, high: f64) -> Self {
        if low <= high { Self { low, high } } else { Self::ALL }
    }

    /// Returns the smallest interval that contains all of these numbers; all numbers if one is NaN.
    #[inline]
    fn spanning(numbers: [f64; 4]) -> Self {
        // Comparisons are faster than `f64::min`, which checks for NaN; NaN is checked separately below.
        let pick = |first: fn(f64, f64) -> bool| numbers.into_iter().reduce(|a, b| if first(b, a) { b } else { a });
        let [low, high] =
            [pick(|b, a| b < a), pick(|b, a| b > a)].map(|bound| bound.expect("the array has four numbers"));
        if numbers.iter().any(|n| n.is_nan()) { Self::ALL } else { Self { low, high } }
    }

    /// Returns the interval that contains one number; all numbers for NaN.
    #[must_use]
    pub fn point(x: f64) -> Self {
        Self::between(x, x)
    }

    /// Returns the interval of the numbers at most `radius` away from `centre`.
    #[must_use]
    pub fn around(centre: f64, radius: f64) -> Self {
        Self::between(centre - radius, centre + radius)
    }

    /// Returns the smallest interval that contains both.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Returns true if the interval contains a number.
    #[must_use]
    pub fn contains(self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }

    /// Returns the largest absolute value in the interval.
    #[must_use]
    pub fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// Returns the number of a single-point interval; `None` otherwise.
    #[must_use]
    pub fn single(self) -> Option<f64> {
        (self.low == self.high).then_some(self.low)
    }

    /// Returns the range of a monotone function over the interval.
    #[must_use]
    pub fn monotone(self, f: impl Fn(f64) -> f64) -> Self {
        Self::between(f(self.low), f(self.high))
    }

    /// Returns the part between two bounds; the nearer bound if that part is empty.
    #[must_use]
    pub fn clamp(self, low: f64, high: f64) -> Self {
        Self { low: self.low.clamp(low, high), high: self.high.clamp(low, high) }
    }

    /// Returns `1/x`; all numbers if the interval contains 0.
    #[must_use]
    pub fn reciprocal(self) -> Self {
        if self.contains(0.0) { Self::ALL } else { self.monotone(f64::recip) }
    }

    /// Returns `x^2`.
    #[must_use]
    pub fn square(self) -> Self {
        let largest = self.magnitude();
        let least = if self.contains(0.0) { 0.0 } else { self.low.abs().min(self.high.abs()) };
        Self { low: least * least, high: largest * largest }
    }

    /// Returns `cos x`, `x` in rad.
    #[must_use]
    pub fn cos(self) -> Self {
        if !self.low.is_finite() || !self.high.is_finite() || self.high - self.low >= TAU {
            return Self { low: -1.0, high: 1.0 };
        }
        // Multiples of 2 pi are maxima, odd multiples of pi minima.
        let reaches = |phase: f64| ((self.high - phase) / TAU).floor() >= ((self.low - phase) / TAU).ceil();
        let ends = self.monotone(math::cos);
        Self { low: if reaches(PI) { -1.0 } else { ends.low }, high: if reaches(0.0) { 1.0 } else { ends.high } }
    }

    /// Returns `sin x`, `x` in rad.
    #[must_use]
    pub fn sin(self) -> Self {
        let reaches = |phase: f64| ((self.high - phase) / TAU).floor() >= ((self.low - phase) / TAU).ceil();
        if !self.low.is_finite() || !self.high.is_finite() || self.high - self.low >= TAU {
            return Self { low: -1.0, high: 1.0 };
        }
        let ends = self.monotone(math::sin);
        Self {
            low: if reaches(-FRAC_PI_2) { -1.0 } else { ends.low },
            high: if reaches(FRAC_PI_2) { 1.0 } else { ends.high },
        }
    }

    /// Returns `x^exponent`; all numbers if `x` may be negative and the exponent is not an integer.
    #[must_use]
    pub fn power(self, exponent: f64) -> Self {
        if exponent == 0.0 {
            return Self::point(1.0);
        }
        let power = |x: f64| math::powf(x, exponent);
        if exponent < 0.0 {
            return self.power(-exponent).reciprocal();
        }
        if self.low >= 0.0 {
            return self.monotone(power);
        }
        if exponent.fract() != 0.0 {
            return Self::ALL;
        }
        if exponent % 2.0 != 0.0 {
            return self.monotone(power);
        }
        let largest = self.magnitude();
        let least = if self.contains(0.0) { 0.0 } else { self.low.abs().min(self.high.abs()) };
        Self::between(power(least), power(largest))
    }
}

impl Add for Interval {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self::ordered(self.low + o.low, self.high + o.high)
    }
}
impl Sub for Interval {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self::ordered(self.low - o.high, self.high - o.low)
    }
}
impl Mul for Interval {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        let pairs = [(self.low, o.low), (self.low, o.high), (self.high, o.low), (self.high, o.high)];
        let products = pairs.map(|(a, b)| a * b);
        if products.iter().sum::<f64>().is_finite() {
            return Self::spanning(products);
        }
        // 0 times an infinite bound is 0, because the numbers themselves are finite.
        Self::spanning(pairs.map(|(a, b)| if a == 0.0 || b == 0.0 { 0.0 } else { a * b }))
    }
}
impl Div for Interval {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        if o.contains(0.0) {
            return Self::ALL;
        }
        Self::spanning([self.low / o.low, self.low / o.high, self.high / o.low, self.high / o.high])
    }
}
impl Neg for Interval {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}
