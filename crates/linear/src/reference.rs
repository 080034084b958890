//! Independent reference for the tests: characteristic polynomials and their roots in about 32 digits.

use std::ops::{Add, Div, Mul, Neg, Sub};

use mops_math as math;
use mops_math::complex;
use nalgebra::DMatrix;

use super::Complex;

/// Double-double number: an unevaluated sum, the second term at most half a unit in the last place of the first.
///
/// Source: T. J. Dekker, A floating-point technique for extending the available precision, Numerische Mathematik 18
/// (1971) 224-242.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Double(pub f64, pub f64);

fn quick_sum(a: f64, b: f64) -> Double {
    let s = a + b;
    Double(s, b - (s - a))
}

impl From<f64> for Double {
    fn from(x: f64) -> Self {
        Self(x, 0.0)
    }
}

impl Add for Double {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        let two_sum = |a: f64, b: f64| {
            let s = a + b;
            let t = s - a;
            (s, (a - (s - t)) + (b - t))
        };
        let (s, e) = two_sum(self.0, o.0);
        let (t, f) = two_sum(self.1, o.1);
        let Self(s, e) = quick_sum(s, e + t);
        quick_sum(s, e + f)
    }
}

impl Neg for Double {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl Sub for Double {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for Double {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let p = self.0 * o.0;
        let e = math::mul_add(self.0, o.0, -p);
        quick_sum(p, e + (self.0 * o.1 + self.1 * o.0))
    }
}

impl Div for Double {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let q = self.0 / o.0;
        let rest = self - o * Self::from(q);
        let q2 = rest.0 / o.0;
        let rest = rest - o * Self::from(q2);
        quick_sum(q, q2) + Self::from(rest.0 / o.0)
    }
}

/// Complex double-double number.
pub type Exact = nalgebra::Complex<Double>;

/// Converts a number exactly.
pub fn exact(z: Complex) -> Exact {
    Exact { re: z.re.into(), im: z.im.into() }
}

/// Returns the product of two numbers.
pub fn product(a: Exact, b: Exact) -> Exact {
    Exact { re: a.re * b.re - a.im * b.im, im: a.re * b.im + a.im * b.re }
}

/// Returns the sum of two numbers.
pub fn sum(a: Exact, b: Exact) -> Exact {
    Exact { re: a.re + b.re, im: a.im + b.im }
}

/// Returns the inverse of a number.
pub fn inverse(a: Exact) -> Exact {
    let square = a.re * a.re + a.im * a.im;
    Exact { re: a.re / square, im: -a.im / square }
}

/// Double-double matrix, row by row.
pub type ExactMatrix = Vec<Vec<Double>>;

/// Converts a matrix exactly.
pub fn exactly(a: &DMatrix<f64>) -> ExactMatrix {
    a.row_iter().map(|row| row.iter().map(|&x| x.into()).collect()).collect()
}

/// Returns the product of two matrices.
pub fn times(a: &ExactMatrix, b: &ExactMatrix) -> ExactMatrix {
    let zero = Double::from(0.0);
    let entry = |row: &Vec<Double>, j: usize| row.iter().zip(b).fold(zero, |sum, (&x, other)| sum + x * other[j]);
    a.iter().map(|row| (0..b[0].len()).map(|j| entry(row, j)).collect()).collect()
}

/// Returns the difference of two matrices.
pub fn minus(a: &ExactMatrix, b: &ExactMatrix) -> ExactMatrix {
    a.iter().zip(b).map(|(r, s)| r.iter().zip(s).map(|(&x, &y)| x - y).collect()).collect()
}

/// Returns the coefficients, ascending powers, of the characteristic polynomial of a matrix by the Faddeev-LeVerrier
/// method.
pub fn characteristic(a: &ExactMatrix) -> Vec<Double> {
    let n = a.len();
    let mut coefficients = vec![Double::from(0.0); n + 1];
    coefficients[n] = Double::from(1.0);
    let mut m = vec![vec![Double::from(0.0); n]; n];
    for k in 1..=n {
        m = times(a, &m);
        (0..n).for_each(|i| m[i][i] = m[i][i] + coefficients[n - k + 1]);
        let am = times(a, &m);
        let trace = (0..n).fold(Double::from(0.0), |sum, i| sum + am[i][i]);
        coefficients[n - k] = -trace / Double::from(k as f64);
    }
    coefficients
}

/// Returns the roots of a polynomial with coefficients in ascending powers by the Ehrlich-Aberth method.
pub fn roots(coefficients: &[Double]) -> Vec<Complex> {
    // Roots at 0 are split off exactly.
    let at_zero = coefficients.iter().take_while(|c| c.0 == 0.0).count();
    let coefficients = &coefficients[at_zero..];
    let n = coefficients.len() - 1;
    let leading = coefficients[n];
    let monic: Vec<Double> = coefficients.iter().map(|&c| c / leading).collect();
    let radius = (0..n).map(|i| math::powf(monic[i].0.abs(), 1.0 / (n - i) as f64)).fold(0.0, f64::max);
    let mut z: Vec<Exact> =
        (0..n).map(|i| exact(complex::from_polar(radius, 0.4 + std::f64::consts::TAU * i as f64 / n as f64))).collect();
    let zero = exact(Complex::new(0.0, 0.0));
    for _ in 0..2000 {
        let mut moved = 0.0f64;
        for i in 0..n {
            let (mut value, mut slope) = (zero, zero);
            for &c in monic.iter().rev() {
                slope = sum(product(slope, z[i]), value);
                value = sum(product(value, z[i]), Exact { re: c, im: 0.0.into() });
            }
            // A value at rounding level cannot be improved.
            let size = math::hypot(z[i].re.0, z[i].im.0);
            let largest = monic.iter().rev().fold(0.0, |sum, c| sum * size + c.0.abs());
            if math::hypot(value.re.0, value.im.0) <= 1e-31 * largest {
                continue;
            }
            let newton = product(slope, inverse(value));
            let others = (0..n)
                .filter(|&j| j != i && z[j] != z[i])
                .fold(zero, |total, j| sum(total, inverse(Exact { re: z[i].re - z[j].re, im: z[i].im - z[j].im })));
            let divisor = Exact { re: newton.re - others.re, im: newton.im - others.im };
            let step = inverse(divisor);
            z[i] = Exact { re: z[i].re - step.re, im: z[i].im - step.im };
            moved = moved.max(math::hypot(step.re.0, step.im.0) / size);
        }
        if moved < 1e-30 {
            break;
        }
    }
    let found = z.into_iter().map(|z| Complex::new(z.re.0, z.im.0));
    found.chain(std::iter::repeat_n(Complex::new(0.0, 0.0), at_zero)).collect()
}

/// Returns the eigenvalues of a matrix.
pub fn eigenvalues(a: &DMatrix<f64>) -> Vec<Complex> {
    roots(&characteristic(&exactly(a)))
}

#[test]
fn the_reference_keeps_about_thirty_digits() {
    let third = Double::from(1.0) / Double::from(3.0);
    let rest = third * Double::from(3.0) - Double::from(1.0);
    assert!(rest.0.abs() < 1e-31, "{rest:?}");
    // (s - 1)^3 (s - 1.001): a triple root moves by the cube root of the rounding error.
    let shifted = |x: f64| [Double::from(-x), Double::from(1.0)];
    let mut all = vec![Double::from(1.0)];
    for factor in [shifted(1.0), shifted(1.0), shifted(1.0), shifted(1.001)] {
        let mut next = vec![Double::from(0.0); all.len() + 1];
        for (i, &c) in all.iter().enumerate() {
            next[i] = next[i] + c * factor[0];
            next[i + 1] = next[i + 1] + c;
        }
        all = next;
    }
    assert!(
        roots(&all).iter().all(|z| complex::norm(z - 1.0) < 1e-8 || complex::norm(z - 1.001) < 1e-14),
        "{:?}",
        roots(&all)
    );
}
