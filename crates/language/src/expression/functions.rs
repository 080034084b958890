//! Functions of expressions, with their derivatives.

use mops_math as math;

use crate::Scalar;

/// Function available in expressions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Function {
    /// Sine of an angle in rad.
    Sin,
    /// Cosine of an angle in rad.
    Cos,
    /// Tangent of an angle in rad.
    Tan,
    /// Arc sine, rad.
    Asin,
    /// Arc cosine, rad.
    Acos,
    /// Arc tangent, rad.
    Atan,
    /// Angle of the point (x, y) = (second, first argument), rad.
    Atan2,
    /// Hyperbolic sine.
    Sinh,
    /// Hyperbolic cosine.
    Cosh,
    /// Hyperbolic tangent.
    Tanh,
    /// Exponential.
    Exp,
    /// Natural logarithm.
    Ln,
    /// Decimal logarithm.
    Log10,
    /// Square root.
    Sqrt,
    /// Absolute value.
    Abs,
    /// Sign: -1, 0 or 1.
    Sign,
    /// Smallest argument.
    Min,
    /// Largest argument.
    Max,
    /// Saturation `clip(x, low, high)`: `x` within the limits, otherwise the limit.
    Clip,
    /// Dead zone `deadzone(x, low, high)`: 0 within the limits, otherwise the distance beyond the limit.
    Deadzone,
    /// Lookup table `table(x, x1, y1, x2, y2, ..)`: linear interpolation, extrapolated beyond the first and last point.
    Table,
    /// Value at an earlier time, `delay(x, time)`: in the equations of a model.
    Delay,
    /// Selection `if(condition, a, b)` or `if(condition, a, condition, b, .., otherwise)`.
    If,
}

/// Name, function, smallest and largest number of arguments.
pub const FUNCTIONS: [(&str, Function, usize, usize); 23] = [
    ("sin", Function::Sin, 1, 1),
    ("cos", Function::Cos, 1, 1),
    ("tan", Function::Tan, 1, 1),
    ("asin", Function::Asin, 1, 1),
    ("acos", Function::Acos, 1, 1),
    ("atan", Function::Atan, 1, 1),
    ("atan2", Function::Atan2, 2, 2),
    ("sinh", Function::Sinh, 1, 1),
    ("cosh", Function::Cosh, 1, 1),
    ("tanh", Function::Tanh, 1, 1),
    ("exp", Function::Exp, 1, 1),
    ("ln", Function::Ln, 1, 1),
    ("log10", Function::Log10, 1, 1),
    ("sqrt", Function::Sqrt, 1, 1),
    ("abs", Function::Abs, 1, 1),
    ("sign", Function::Sign, 1, 1),
    ("min", Function::Min, 2, usize::MAX),
    ("max", Function::Max, 2, usize::MAX),
    ("clip", Function::Clip, 3, 3),
    ("deadzone", Function::Deadzone, 3, 3),
    ("table", Function::Table, 5, usize::MAX),
    ("delay", Function::Delay, 2, 2),
    ("if", Function::If, 3, usize::MAX),
];

impl Function {
    /// Returns the name in expressions.
    pub fn name(self) -> &'static str {
        FUNCTIONS.iter().find(|(_, function, ..)| *function == self).expect("every function has a name").0
    }

    /// Returns the value of a smooth function of one argument; `None` for all other functions.
    #[inline]
    pub fn smooth<S: Scalar>(self, x: S) -> Option<S> {
        let v = x.value();
        Some(match self {
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Tan => x.sin() / x.cos(),
            Self::Asin => x.chain(math::asin(v), tangent(1.0 / (1.0 - v * v).sqrt())),
            Self::Acos => x.chain(math::acos(v), tangent(-1.0 / (1.0 - v * v).sqrt())),
            Self::Atan => x.chain(math::atan(v), 1.0 / (1.0 + v * v)),
            Self::Sinh => x.chain(math::sinh(v), math::cosh(v)),
            Self::Cosh => x.chain(math::cosh(v), math::sinh(v)),
            Self::Tanh => x.tanh(),
            Self::Exp => x.exp(),
            Self::Ln => x.ln(),
            Self::Log10 => x.chain(math::log10(v), std::f64::consts::LOG10_E / v),
            Self::Sqrt => sqrt(x),
            _ => return None,
        })
    }
}

/// Returns a derivative for tangents: 0 where it is infinite, as at the ends of roots and of arcs.
///
/// A simulation at rest there, such as an empty tank, thus keeps finite tangents. A linearisation there is refused,
/// because differences grow where the derivative is given as 0.
#[inline]
fn tangent(derivative: f64) -> f64 {
    if derivative.is_infinite() { 0.0 } else { derivative }
}

/// Returns the square root; its infinite derivative at 0 counts as 0.
#[inline]
pub fn sqrt<S: Scalar>(x: S) -> S {
    if x.value() == 0.0 { x.chain(0.0, 0.0) } else { x.sqrt() }
}

/// Returns the angle of the point (x, y), rad, from -pi to pi.
pub fn atan2<S: Scalar>(y: S, x: S) -> S {
    let (a, b) = (y.value(), x.value());
    let square = a * a + b * b;
    (y * (b / square) - x * (a / square)).chain(math::atan2(a, b), 1.0)
}

/// Returns `base^exponent`; a negative base needs a constant integer exponent.
///
/// An infinite derivative at base 0 counts as 0, as for the square root.
pub fn power<S: Scalar>(base: S, exponent: S) -> S {
    let (a, b) = (base.value(), exponent.value());
    let value = math::powf(a, b);
    if S::DIRECTIONS == 0 {
        return S::from(value);
    }
    let by_base = if b == 0.0 { 0.0 } else { tangent(b * math::powf(a, b - 1.0)) };
    let by_exponent = if a > 0.0 { value * math::ln(a) } else { 0.0 };
    (base * by_base + exponent * by_exponent).chain(value, 1.0)
}

/// Returns -1, 0 or 1, with derivative 0.
pub fn sign<S: Scalar>(x: S) -> S {
    let v = x.value();
    S::from(if v > 0.0 {
        1.0
    } else if v < 0.0 {
        -1.0
    } else {
        0.0
    })
}

/// Returns the smaller argument; the first if they are equal.
#[inline]
pub fn min<S: Scalar>(a: S, b: S) -> S {
    if b.value() < a.value() { b } else { a }
}

/// Returns the larger argument; the first if they are equal.
#[inline]
pub fn max<S: Scalar>(a: S, b: S) -> S {
    if b.value() > a.value() { b } else { a }
}

/// Interpolates linearly between the points `x1, y1, x2, y2, ..` and extrapolates the first and the last line.
pub fn table<S: Scalar>(x: S, points: &[S]) -> S {
    let last = points.len() / 2 - 1;
    let piece = (1..last).find(|&k| x.value() < points[2 * k].value()).unwrap_or(last) - 1;
    line(x, [points[2 * piece], points[2 * piece + 1], points[2 * piece + 2], points[2 * piece + 3]])
}

/// Returns the value at `x` of the straight line through the points `[x1, y1, x2, y2]`.
pub fn line<S: Scalar>(x: S, [x1, y1, x2, y2]: [S; 4]) -> S {
    y1 + (y2 - y1) * ((x - x1) / (x2 - x1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Dual;

    fn difference(f: impl Fn(f64) -> f64, x: f64) -> f64 {
        (f(x + 1e-6) - f(x - 1e-6)) / 2e-6
    }

    #[test]
    fn derivatives_of_smooth_functions_agree_with_differences() {
        let mut count = 0;
        for (name, function, ..) in FUNCTIONS {
            let Some(exact) = function.smooth(Dual::<1>::variable(0.4, 0)) else { continue };
            let near = difference(|x| function.smooth(x).expect("the same function"), 0.4);
            assert!((exact.tangent[0] - near).abs() < 1e-8, "{name}: {exact:?} {near}");
            count += 1;
        }
        assert_eq!(count, 13);
    }

    #[test]
    fn functions_of_two_arguments_have_both_derivatives() {
        let (x, y) = (Dual::<2>::variable(1.3, 0), Dual::<2>::variable(-0.7, 1));
        for (f, g) in [
            (power as fn(Dual<2>, Dual<2>) -> Dual<2>, power as fn(f64, f64) -> f64),
            (atan2 as fn(Dual<2>, Dual<2>) -> Dual<2>, atan2 as fn(f64, f64) -> f64),
        ] {
            let exact = f(x, y);
            assert_eq!(exact.value, g(1.3, -0.7), "tangents change no value");
            let near = [difference(|x| g(x, -0.7), 1.3), difference(|y| g(1.3, y), -0.7)];
            assert!((0..2).all(|k| (exact.tangent[k] - near[k]).abs() < 1e-8), "{exact:?} {near:?}");
        }
        let cube: Dual<1> = power(Dual::variable(-2.0, 0), Dual::from(3.0));
        assert_eq!((cube.value, cube.tangent), (-8.0, [12.0]));
    }

    #[test]
    fn infinite_derivatives_at_the_ends_of_roots_and_arcs_count_as_zero() {
        let at = |x: f64| Dual::<1>::variable(x, 0);
        for (value, found) in [
            (0.0, sqrt(at(0.0))),
            (0.0, power(at(0.0), Dual::from(0.5))),
            (0.0, power(at(0.0), Dual::from(0.9))),
            (std::f64::consts::FRAC_PI_2, Function::Asin.smooth(at(1.0)).unwrap()),
            (std::f64::consts::PI, Function::Acos.smooth(at(-1.0)).unwrap()),
        ] {
            assert_eq!((found.value, found.tangent), (value, [0.0]));
        }
        assert_eq!(power(at(0.0), Dual::from(1.0)).tangent, [1.0]);
        assert_eq!(power(at(0.0), Dual::from(1.5)).tangent, [0.0]);
    }

    #[test]
    fn a_table_is_straight_between_and_beyond_its_points() {
        let points = [0.0, 1.0, 1.0, 3.0, 3.0, 3.0];
        let at = |x: f64| table(x, &points);
        assert_eq!([at(0.5), at(1.0), at(2.0), at(-1.0), at(9.0)], [2.0, 3.0, 3.0, -1.0, 3.0]);
    }
}
