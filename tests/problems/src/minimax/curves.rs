//! Curve fits in the maximum norm: the largest absolute residual counts.

use mops_language::Scalar;
use mops_math as math;

use crate::arithmetic::{dot, sq, sum};
use crate::formula::Functions;
use crate::problem::{Problem, Sense};

pub(super) fn problems() -> Vec<Problem> {
    let curves = vec![
        Problem::new("PBC3", &[1.0; 3], 0.4202142672e-2, Functions::of(pbc3, pbc3)),
        Problem::new("Bard", &[1.0; 3], 0.5081632653e-1, Functions::of(bard, bard)),
        Problem::new("Kowalik-Osborne", &[0.25, 0.39, 0.415, 0.39], 0.8084368386e-2, Functions::of(kowalik, kowalik)),
        Problem::new("Davidon2", &[25.0, 5.0, -5.0, -1.0], 115.7064395, Functions::of(davidon2, davidon2)),
        Problem::new("OET5", &[1.0; 4], 0.2635973497e-2, Functions::of(oet5, oet5)),
        Problem::new("OET6", &[1.0, 1.0, -3.0, -1.0], 0.2016075379e-2, Functions::of(oet6, oet6)),
        Problem {
            reach: 100.0,
            accuracy: Some(1e-6),
            ..Problem::new("GAMMA", &[1.0, 1.0, 10.0, 1.0], 0.1198679749e-6, Functions::of(gamma, gamma))
        },
        Problem::new("EXP", &[0.5, 0.0, 0.0, 0.0, 0.0], 0.1223712511e-3, Functions::of(exp, exp)),
        Problem::new("PBC1", &[0.0, -1.0, 10.0, 1.0, 10.0], 0.2234049605e-1, Functions::of(pbc1, pbc1)),
        Problem::new("EVD61", &[2.0, 2.0, 7.0, 0.0, -2.0, 1.0], 0.3490492654e-1, Functions::of(evd61, evd61)),
        Problem::new("Filter", &FILTER, 0.6185284778e-2, Functions::of(filter, filter)),
        Problem { accuracy: Some(1e-6), ..Problem::new("Watson", &[0.0; 20], 3.3e-10, Functions::of(watson, watson)) },
        Problem::new("Osborne2", &OSBORNE2, 0.4802740071e-1, Functions::of(osborne2, osborne2)),
    ];
    curves.into_iter().map(|problem| Problem { sense: Sense::MaxAbs, ..problem }).collect()
}

/// Returns `count` equidistant numbers from `first` to `last`.
#[allow(clippy::cast_precision_loss)]
fn even(first: f64, last: f64, count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| first + (last - first) * i as f64 / (count - 1) as f64)
}

fn pbc3<S: Scalar>(x: &[S]) -> Vec<S> {
    let data = |t: f64| {
        let swing = 3.0 * math::sin(2.0 * t) + 11.0 * math::cos(2.0 * t);
        3.0 / 20.0 * math::exp(-t) + math::exp(-5.0 * t) / 52.0 - math::exp(-2.0 * t) / 65.0 * swing
    };
    even(0.0, 10.0, 21).map(|t| x[2] / x[1] * (-x[0] * t).exp() * (x[1] * t).sin() - data(t)).collect()
}

fn bard<S: Scalar>(x: &[S]) -> Vec<S> {
    const Y: [f64; 15] = [0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39];
    let at = |(y, u): (&f64, f64)| {
        let (v, w) = (16.0 - u, u.min(16.0 - u));
        -x[0] - S::from(u) / (x[1] * v + x[2] * w) + *y
    };
    Y.iter().zip(even(1.0, 15.0, 15)).map(at).collect()
}

fn kowalik<S: Scalar>(x: &[S]) -> Vec<S> {
    const Y: [f64; 11] = [0.1957, 0.1947, 0.1735, 0.16, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246];
    const U: [f64; 11] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625];
    Y.iter().zip(U).map(|(y, u)| -x[0] * u * (x[1] + u) / ((x[2] + u) * u + x[3]) + *y).collect()
}

fn davidon2<S: Scalar>(x: &[S]) -> Vec<S> {
    even(0.2, 4.0, 20)
        .map(|t| sq(x[0] + x[1] * t - math::exp(t)) + sq(x[2] + x[3] * math::sin(t) - math::cos(t)))
        .collect()
}

fn oet5<S: Scalar>(x: &[S]) -> Vec<S> {
    even(0.25, 1.0, 21).map(|t| x[3] - sq((x[0] * t + x[1]) * t + x[2]) - t.sqrt()).collect()
}

fn oet6<S: Scalar>(x: &[S]) -> Vec<S> {
    even(-0.5, 0.5, 21).map(|t| x[0] * (x[2] * t).exp() + x[1] * (x[3] * t).exp() - 1.0 / (1.0 + t)).collect()
}

/// Stirling's formula with a correction: `x0 (t + x1 + 1/(x2 t + x3))^(t + 1/2) / (e^t Gamma(t + 1)) - 1`.
fn gamma<S: Scalar>(x: &[S]) -> Vec<S> {
    const T: [f64; 61] = [
        1.0, 1.01, 1.02, 1.03, 1.05, 1.075, 1.1, 1.125, 1.15, 1.2, 1.25, 1.3, 1.35, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 2.0,
        2.1, 2.2, 2.3, 2.5, 2.75, 3.0, 3.25, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 6.5, 7.0, 7.5, 8.0, 8.5, 9.0, 10.0, 11.0,
        12.0, 13.0, 15.0, 17.5, 20.0, 22.5, 25.0, 30.0, 35.0, 40.0, 50.0, 60.0, 70.0, 80.0, 100.0, 150.0, 200.0, 300.0,
        500.0, 1e5,
    ];
    let at = |t: f64| {
        // Factor with e^t Gamma(t + 1) = ((t + 1) y)^(t + 1/2), so that the base of the power is near 1.
        let y = (log_gamma(t + 1.0) + t) / (t + 0.5) - math::ln(t + 1.0);
        let base = (x[1] + t + S::from(1.0) / (x[2] * t + x[3])) / ((t + 1.0) * math::exp(y));
        x[0] * base.abs().powf(t + 0.5) - 1.0
    };
    T.map(at).to_vec()
}

/// Returns the logarithm of the gamma function of a positive number.
///
/// Source: NIST Handbook of Mathematical Functions (2010), equations 5.5.1 and 5.11.1.
fn log_gamma(mut z: f64) -> f64 {
    let mut product = 1.0;
    while z < 15.0 {
        product *= z;
        z += 1.0;
    }
    let series = 1.0 / 12.0
        - (1.0 / 360.0 - (1.0 / 1260.0 - (1.0 / 1680.0 - 1.0 / 1188.0 / (z * z)) / (z * z)) / (z * z)) / (z * z);
    (z - 0.5) * math::ln(z) - z + 0.5 * math::ln(std::f64::consts::TAU) + series / z - math::ln(product)
}

fn exp<S: Scalar>(x: &[S]) -> Vec<S> {
    let at = |t: f64| (x[0] + x[1] * t) / ((x[2] + (x[3] + x[4] * t) * t) * t + 1.0) - math::exp(t);
    even(-1.0, 1.0, 21).map(at).collect()
}

fn pbc1<S: Scalar>(x: &[S]) -> Vec<S> {
    let data = |t: f64| (math::powi(8.0 * t - 1.0, 2) + 1.0).sqrt() * math::atan(8.0 * t) / (8.0 * t);
    let at = |t: f64| (x[0] + (x[1] + x[2] * t) * t) / ((x[3] + x[4] * t) * t + 1.0) - data(t);
    even(-1.0, 1.0, 30).map(at).collect()
}

fn evd61<S: Scalar>(x: &[S]) -> Vec<S> {
    let data = |t: f64| {
        0.5 * math::exp(-t) - math::exp(-2.0 * t)
            + 0.5 * math::exp(-3.0 * t)
            + 1.5 * math::exp(-1.5 * t) * math::sin(7.0 * t)
            + math::exp(-2.5 * t) * math::sin(5.0 * t)
    };
    let at = |t: f64| x[0] * (-x[1] * t).exp() * (x[2] * t + x[3]).cos() + x[4] * (-x[5] * t).exp() - data(t);
    even(0.0, 5.0, 51).map(at).collect()
}

const FILTER: [f64; 9] = [0.0, 1.0, 0.0, -0.15, 0.0, -0.68, 0.0, -0.72, 0.37];

/// Magnitude of a digital filter of two second-order sections, with `1 + x z^-1 + y z^-2` in numerator and denominator,
/// compared with a notch.
#[allow(clippy::cast_precision_loss)]
fn filter<S: Scalar>(x: &[S]) -> Vec<S> {
    let frequency = |i: usize| match i {
        0..6 => 0.01 * i as f64,
        6..20 => 0.07 + 0.03 * (i - 6) as f64,
        20 => 0.5,
        21..35 => 0.54 + 0.03 * (i - 21) as f64,
        _ => 0.95 + 0.01 * (i - 35) as f64,
    };
    let at = |f: f64| {
        let (sin, cos) = math::sin_cos(std::f64::consts::PI * f);
        let square = |j: usize| sq(x[j] + (x[j + 1] + 1.0) * cos) + sq((-x[j + 1] + 1.0) * sin);
        x[8] * (square(0) / square(2)).sqrt() * (square(4) / square(6)).sqrt() - (1.0 - 2.0 * f).abs()
    };
    (0..41).map(frequency).map(at).collect()
}

/// Polynomial that solves `p' = p^2 + 1`, `p(0) = 0`, at 29 points.
#[allow(clippy::cast_precision_loss, clippy::cast_possible_wrap, clippy::cast_possible_truncation)]
fn watson<S: Scalar>(x: &[S]) -> Vec<S> {
    let at = |t: f64| {
        let slope: Vec<f64> = (1..x.len()).map(|j| j as f64 * math::powi(t, j as i32 - 1)).collect();
        let value: Vec<f64> = (0..x.len()).map(|j| math::powi(t, j as i32)).collect();
        dot(&slope, &x[1..]) - sq(dot(&value, x)) - 1.0
    };
    let ends = vec![x[0], x[1] - sq(x[0]) - 1.0];
    ends.into_iter().chain((1..30).map(|i| at(f64::from(i) / 29.0))).collect()
}

const OSBORNE2: [f64; 11] = [1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5];

fn osborne2<S: Scalar>(x: &[S]) -> Vec<S> {
    const Y: [f64; 65] = [
        1.366, 1.191, 1.112, 1.013, 0.991, 0.885, 0.831, 0.847, 0.786, 0.725, 0.746, 0.679, 0.608, 0.655, 0.616, 0.606,
        0.602, 0.626, 0.651, 0.724, 0.649, 0.649, 0.694, 0.644, 0.624, 0.661, 0.612, 0.558, 0.553, 0.495, 0.500, 0.423,
        0.395, 0.375, 0.372, 0.391, 0.396, 0.405, 0.428, 0.429, 0.523, 0.562, 0.607, 0.653, 0.672, 0.708, 0.633, 0.668,
        0.645, 0.632, 0.591, 0.559, 0.597, 0.625, 0.739, 0.710, 0.729, 0.720, 0.636, 0.581, 0.428, 0.292, 0.162, 0.098,
        0.054,
    ];
    let model = |t: f64| {
        let peaks = (0..3).map(|i| x[1 + i] * (-x[5 + i] * sq(-x[8 + i] + t)).exp());
        x[0] * (-x[4] * t).exp() + sum(peaks)
    };
    Y.iter().zip(even(0.0, 6.4, 65)).map(|(y, t)| -model(t) + *y).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_logarithm_of_the_gamma_function_meets_factorials() {
        let mut factorial = 1.0_f64;
        for n in 1..20 {
            factorial *= f64::from(n);
            assert!((log_gamma(f64::from(n) + 1.0) - math::ln(factorial)).abs() < 1e-13 * math::ln(factorial).max(1.0));
        }
    }
}
