//! Enclosures: bounds of a quantity and of its rate over a time interval, to prove that the quantity has no zero there.

mod interval;

use std::ops::{Add, Div, Mul, Neg, Sub};

use mops_math as math;

use crate::expression::{Comparison, Function};
pub use interval::Interval;

/// Bounds of a quantity `x(t)` over a time interval, and of its derivative `dx/dt`.
///
/// At a kink, the rate encloses the one-sided derivatives (Clarke's generalised gradient). At a jump, there is no
/// enclosure.
///
/// Source: R. Moore, R. Kearfott, M. Cloud, Introduction to Interval Analysis (SIAM 2009), chapters 5 and 6; for hybrid
/// systems: J. Esposito, V. Kumar, G. Pappas, Accurate event detection for simulating hybrid systems, HSCC 2001,
/// 204-217.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enclosure {
    /// Bounds of `x`.
    pub value: Interval,
    /// Bounds of `dx/dt`, per s.
    pub rate: Interval,
}

impl From<f64> for Enclosure {
    fn from(x: f64) -> Self {
        Self { value: Interval::point(x), rate: Interval::ZERO }
    }
}

impl Enclosure {
    /// Enclosure without information.
    pub const UNKNOWN: Self = Self { value: Interval::ALL, rate: Interval::ALL };

    /// Returns the enclosure of time from `from` to `to`, s.
    #[must_use]
    pub fn of_time(from: f64, to: f64) -> Self {
        Self { value: Interval::between(from, to), rate: Interval::point(1.0) }
    }

    /// Returns the enclosure of the polynomial `sum_k c_k d^k` in the distance `d` from the interval centre,
    /// `|d| <= radius` in s.
    #[must_use]
    pub fn of_polynomial(coefficients: &[f64], radius: f64) -> Self {
        // Centres and radii: even powers of `d` range from 0 to the power of the radius, odd ones between plus and
        // minus that.
        let (mut value, mut rate) = ([0.0; 2], [0.0; 2]);
        let add = |sum: &mut [f64; 2], term: f64, power: usize| match power {
            0 => sum[0] += term,
            power if power % 2 == 0 => {
                sum[0] += 0.5 * term;
                sum[1] += 0.5 * term.abs();
            }
            _ => sum[1] += term.abs(),
        };
        let (mut power, mut order) = (1.0, 0.0);
        for (k, &c) in coefficients.iter().enumerate() {
            if k > 0 {
                add(&mut rate, order * c * power, k - 1);
                power *= radius;
            }
            add(&mut value, c * power, k);
            order += 1.0;
        }
        let around = |[middle, radius]: [f64; 2]| Interval::around(middle, radius);
        Self { value: around(value), rate: around(rate) }
    }

    /// Returns the enclosure of a function of the quantity, given the bounds of the function and of its derivative
    /// (chain rule).
    #[must_use]
    pub fn chain(self, value: Interval, derivative: Interval) -> Self {
        Self { value, rate: derivative * self.rate }
    }

    /// Returns the smallest enclosure that contains both.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        Self { value: self.value.hull(other.value), rate: self.rate.hull(other.rate) }
    }

    /// Returns the sine of an angle in rad.
    #[must_use]
    pub fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }

    /// Returns the cosine of an angle in rad.
    #[must_use]
    pub fn cos(self) -> Self {
        self.chain(self.value.cos(), -self.value.sin())
    }

    /// Returns a smooth function of one argument, restricted to its domain.
    ///
    /// # Panics
    /// For functions of several arguments and functions with kinks, which are compiled to other instructions.
    #[must_use]
    pub fn function(self, function: Function) -> Self {
        let x = self.value;
        let one = Interval::point(1.0);
        match function {
            Function::Sin => self.sin(),
            Function::Cos => self.cos(),
            Function::Tan => self.sin() / self.cos(),
            Function::Asin | Function::Acos => {
                let x = x.clamp(-1.0, 1.0);
                let slope = ((one - x.square()).clamp(0.0, 1.0)).monotone(|d| d.sqrt().recip());
                match function {
                    Function::Asin => self.chain(x.monotone(math::asin), slope),
                    _ => self.chain(x.monotone(math::acos), -slope),
                }
            }
            Function::Atan => self.chain(x.monotone(math::atan), (one + x.square()).reciprocal()),
            Function::Sinh => self.chain(x.monotone(math::sinh), even(x, math::cosh)),
            Function::Cosh => self.chain(even(x, math::cosh), x.monotone(math::sinh)),
            Function::Tanh => {
                let t = x.monotone(math::tanh);
                self.chain(t, one - t.square())
            }
            Function::Exp => {
                let e = x.monotone(math::exp);
                self.chain(e, e)
            }
            Function::Ln | Function::Log10 => {
                let x = x.clamp(0.0, f64::INFINITY);
                let slope = x.monotone(f64::recip);
                match function {
                    Function::Ln => self.chain(x.monotone(math::ln), slope),
                    _ => self.chain(x.monotone(math::log10), slope * Interval::point(std::f64::consts::LOG10_E)),
                }
            }
            Function::Sqrt => {
                let root = x.clamp(0.0, f64::INFINITY).monotone(f64::sqrt);
                self.chain(root, root.monotone(|r| 0.5 / r))
            }
            _ => unreachable!("`{}` is compiled to other instructions", function.name()),
        }
    }

    /// Returns `self^2`.
    #[must_use]
    pub fn square(self) -> Self {
        self.chain(self.value.square(), Interval::point(2.0) * self.value)
    }

    /// Returns `self^exponent`.
    #[must_use]
    pub fn power(self, exponent: Self) -> Self {
        if let Some(b) = exponent.value.single() {
            let slope = Interval::point(b) * self.value.power(b - 1.0);
            return self.chain(self.value.power(b), if b == 0.0 { Interval::point(0.0) } else { slope });
        }
        if self.value.low <= 0.0 {
            return Self::UNKNOWN;
        }
        (self.function(Function::Ln) * exponent).function(Function::Exp)
    }

    /// Returns the angle of the point (`x`, `self`), rad.
    #[must_use]
    pub fn atan2(self, x: Self) -> Self {
        let square = self.value.square() + x.value.square();
        let rate = (x.value * self.rate - self.value * x.rate) / square;
        // The angle jumps across the negative x axis.
        if self.value.contains(0.0) && x.value.low <= 0.0 {
            return Self::UNKNOWN;
        }
        let corner = |y: f64, x: f64| Interval::point(math::atan2(y, x));
        let value = corner(self.value.low, x.value.low)
            .hull(corner(self.value.low, x.value.high))
            .hull(corner(self.value.high, x.value.low))
            .hull(corner(self.value.high, x.value.high));
        Self { value, rate }
    }

    /// Returns 1 if the comparison holds, 0 if it does not, and both if it may.
    #[must_use]
    pub fn holds(self, comparison: Comparison, other: Self) -> Self {
        let difference = self.value - other.value;
        let [low, high] = [difference.low, difference.high].map(|d| f64::from(u8::from(comparison.holds(d, 0.0))));
        Self { value: Interval::between(low, high), rate: Interval::point(0.0) }
    }

    /// Returns `a` if `self` is positive, `b` if it is not, and the hull of both if undecided.
    #[must_use]
    pub fn choose(self, a: Self, b: Self) -> Self {
        match self.value {
            c if c.low > 0.0 => a,
            c if c.high <= 0.0 => b,
            _ => a.hull(b),
        }
    }
}

/// Returns the range of an even function that increases with the absolute value.
fn even(x: Interval, f: impl Fn(f64) -> f64) -> Interval {
    let least = if x.contains(0.0) { 0.0 } else { x.low.abs().min(x.high.abs()) };
    Interval::between(f(least), f(x.magnitude()))
}

impl Add for Enclosure {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self { value: self.value + o.value, rate: self.rate + o.rate }
    }
}
impl Sub for Enclosure {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self { value: self.value - o.value, rate: self.rate - o.rate }
    }
}
impl Mul for Enclosure {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        let value = self.value * o.value;
        // Most factors are constants.
        let rate = match [self.rate, o.rate].map(|rate| rate == Interval::ZERO) {
            [true, true] => Interval::ZERO,
            [true, false] => self.value * o.rate,
            [false, true] => self.rate * o.value,
            [false, false] => self.rate * o.value + self.value * o.rate,
        };
        Self { value, rate }
    }
}
impl Div for Enclosure {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        let inverse = o.value.reciprocal();
        Self { value: self.value * inverse, rate: (self.rate - self.value * inverse * o.rate) * inverse }
    }
}
impl Neg for Enclosure {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { value: -self.value, rate: -self.rate }
    }
}

#[cfg(test)]
mod tests;
