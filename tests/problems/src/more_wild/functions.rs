//! Residuals and initial guesses of the 22 functions.

use std::f64::consts::PI;

use mops_language::Scalar;
use mops_math as math;

use super::data::{BARD, KOWALIK, KOWALIK_AT, MEYER, OSBORNE_1, OSBORNE_2};
use crate::arithmetic::{atan, c, cube, sq, sum};

/// Returns the initial guess of a function in `n` variables.
#[allow(clippy::cast_precision_loss)]
pub(super) fn start(function: u32, n: usize) -> Vec<f64> {
    match function {
        1..=3 | 19 => vec![1.0; n],
        4 => vec![-1.2, 1.0],
        5 => vec![-1.0, 0.0, 0.0],
        6 => vec![3.0, -1.0, 0.0, 1.0],
        7 => vec![0.5, -2.0],
        8 => vec![1.0; 3],
        9 => vec![0.25, 0.39, 0.415, 0.39],
        10 => vec![0.02, 4000.0, 250.0],
        12 => vec![0.0, 10.0, 20.0],
        13 => vec![0.3, 0.4],
        14 => vec![25.0, 5.0, -5.0, -1.0],
        15 => (1..=n).map(|k| k as f64 / (n + 1) as f64).collect(),
        17 => vec![0.5, 1.5, 1.0, 0.01, 0.02],
        18 => vec![1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5],
        21 => mancino_start(n),
        22 => vec![-0.3, -0.39, 0.3, -0.344, -1.2, 2.69, 1.59, -1.5],
        _ => vec![0.5; n],
    }
}

/// Returns the `m` residuals at `x`.
pub(super) fn residuals<S: Scalar>(function: u32, m: usize, x: &[S]) -> Vec<S> {
    match function {
        1..=3 => linear(function, m, x),
        4 => vec![(x[1] - sq(x[0])) * 10.0, -x[0] + 1.0],
        5 => helical_valley(x),
        6 => vec![
            x[0] + x[1] * 10.0,
            (x[2] - x[3]) * 5.0_f64.sqrt(),
            sq(x[1] - x[2] * 2.0),
            sq(x[0] - x[3]) * 10.0_f64.sqrt(),
        ],
        7 => vec![x[0] + ((-x[1] + 5.0) * x[1] - 2.0) * x[1] - 13.0, x[0] + ((x[1] + 1.0) * x[1] - 14.0) * x[1] - 29.0],
        8 => bard(x),
        9 => {
            let of = |(v, y): (&f64, &f64)| -x[0] * ((x[1] + *v) * *v) / ((x[2] + *v) * *v + x[3]) + *y;
            KOWALIK_AT.iter().zip(&KOWALIK).map(of).collect()
        }
        10 => {
            let of = |(i, y): (u32, &f64)| x[0] * (x[1] / (x[2] + 45.0 + 5.0 * f64::from(i))).exp() - *y;
            (1..).zip(&MEYER).map(of).collect()
        }
        11 => watson(x),
        12..=14 => exponentials(function, m, x),
        15 => chebyquad(m, x),
        16 => brown_almost_linear(x),
        17 => {
            let of = |(i, y): (u32, &f64)| {
                let t = -10.0 * f64::from(i);
                -(x[0] + x[1] * (x[3] * t).exp() + x[2] * (x[4] * t).exp()) + *y
            };
            (0..).zip(&OSBORNE_1).map(of).collect()
        }
        18 => osborne_2(x),
        19 => bdqrtic(x),
        20 => std::iter::once(x[0] - 1.0).chain(x.windows(2).map(|x| (x[1] - cube(x[0])) * 10.0)).collect(),
        21 => mancino(x),
        _ => heart(x),
    }
}

/// Linear functions: of full rank, of rank one, and of rank one with zero columns and rows.
#[allow(clippy::cast_precision_loss)]
fn linear<S: Scalar>(function: u32, m: usize, x: &[S]) -> Vec<S> {
    let n = x.len();
    let weighted = |from: usize, to: usize| sum((from..to).map(|j| x[j] * (j + 1) as f64));
    match function {
        1 => {
            let mean = sum(x.iter().copied()) * (2.0 / m as f64) + 1.0;
            (0..m).map(|i| if i < n { x[i] - mean } else { -mean }).collect()
        }
        2 => (0..m).map(|i| weighted(0, n) * (i + 1) as f64 - 1.0).collect(),
        _ => {
            let inner = weighted(1, n - 1);
            (0..m).map(|i| if i + 1 < m { inner * i as f64 - 1.0 } else { c(-1.0) }).collect()
        }
    }
}

fn helical_valley<S: Scalar>(x: &[S]) -> Vec<S> {
    let turns = match x[0].value() {
        first if first > 0.0 => atan(x[1] / x[0]) / (2.0 * PI),
        first if first < 0.0 => atan(x[1] / x[0]) / (2.0 * PI) + 0.5,
        _ if x[1].value() == 0.0 => c(0.0),
        _ => c(0.25),
    };
    vec![(x[2] - turns * 10.0) * 10.0, ((sq(x[0]) + sq(x[1])).sqrt() - 1.0) * 10.0, x[2]]
}

fn bard<S: Scalar>(x: &[S]) -> Vec<S> {
    let of = |(i, y): (u32, &f64)| {
        let (u, v) = (f64::from(i), f64::from(16 - i));
        -(x[0] + c::<S>(u) / (x[1] * v + x[2] * u.min(v))) + *y
    };
    (1..).zip(&BARD).map(of).collect()
}

#[allow(clippy::cast_precision_loss)]
fn watson<S: Scalar>(x: &[S]) -> Vec<S> {
    let of = |i: u32| {
        let t = f64::from(i) / 29.0;
        let power = |j: usize| math::powi(t, i32::try_from(j).expect("few variables"));
        let slope = sum((1..x.len()).map(|j| x[j] * (j as f64 * power(j - 1))));
        slope - sq(sum((0..x.len()).map(|j| x[j] * power(j)))) - 1.0
    };
    (1..30).map(of).chain([x[0], x[1] - sq(x[0]) - 1.0]).collect()
}

/// Box in three dimensions, Jennrich and Sampson, Brown and Dennis.
#[allow(clippy::cast_precision_loss)]
fn exponentials<S: Scalar>(function: u32, m: usize, x: &[S]) -> Vec<S> {
    let of = |i: usize| {
        let i = i as f64;
        match function {
            12 => {
                (x[0] * (-i / 10.0)).exp() - (x[1] * (-i / 10.0)).exp() + x[2] * (math::exp(-i) - math::exp(-i / 10.0))
            }
            13 => -(x[0] * i).exp() - (x[1] * i).exp() + (2.0 + 2.0 * i),
            _ => {
                let t = i / 5.0;
                sq(x[0] + x[1] * t - math::exp(t)) + sq(x[2] + x[3] * math::sin(t) - math::cos(t))
            }
        }
    };
    (1..=m).map(of).collect()
}

#[allow(clippy::cast_precision_loss)]
fn chebyquad<S: Scalar>(m: usize, x: &[S]) -> Vec<S> {
    let mut means = vec![c::<S>(0.0); m];
    for x in x {
        let (mut before, mut now) = (c::<S>(1.0), *x * 2.0 - 1.0);
        let double = now * 2.0;
        for mean in &mut means {
            *mean += now;
            (before, now) = (now, double * now - before);
        }
    }
    let integral = |i: usize| if i % 2 == 1 { 1.0 / math::mul_add((i + 1) as f64, (i + 1) as f64, -1.0) } else { 0.0 };
    means.into_iter().enumerate().map(|(i, mean)| mean / x.len() as f64 + integral(i)).collect()
}

#[allow(clippy::cast_precision_loss)]
fn brown_almost_linear<S: Scalar>(x: &[S]) -> Vec<S> {
    let n = x.len();
    let total = sum(x.iter().copied()) - (n + 1) as f64;
    let product = x.iter().fold(c::<S>(1.0), |product, x| product * *x);
    x[..n - 1].iter().map(|x| *x + total).chain([product - 1.0]).collect()
}

fn osborne_2<S: Scalar>(x: &[S]) -> Vec<S> {
    let of = |(i, y): (u32, &f64)| {
        let t = f64::from(i) / 10.0;
        let bell = |k: usize| x[k + 1] * (-x[k + 5] * sq(-x[k + 8] + t)).exp();
        -(x[0] * (x[4] * -t).exp() + bell(0) + bell(1) + bell(2)) + *y
    };
    (0..).zip(&OSBORNE_2).map(of).collect()
}

fn bdqrtic<S: Scalar>(x: &[S]) -> Vec<S> {
    let n = x.len();
    let linear = (0..n - 4).map(|i| x[i] * -4.0 + 3.0);
    let quartic = (0..n - 4)
        .map(|i| sq(x[i]) + sq(x[i + 1]) * 2.0 + sq(x[i + 2]) * 3.0 + sq(x[i + 3]) * 4.0 + sq(x[n - 1]) * 5.0);
    linear.chain(quartic).collect()
}

/// `v (sin(ln v)^5 + cos(ln v)^5)`.
fn wave<S: Scalar>(v: S) -> S {
    let (s, c) = v.ln().sin_cos();
    v * (sq(sq(s)) * s + sq(sq(c)) * c)
}

#[allow(clippy::cast_precision_loss)]
fn mancino<S: Scalar>(x: &[S]) -> Vec<S> {
    let n = x.len();
    let of = |i: usize| {
        let waves = sum((0..n).map(|j| wave((sq(x[i]) + (i + 1) as f64 / (j + 1) as f64).sqrt())));
        x[i] * 1400.0 + math::powi(i as f64 - 49.0, 3) + waves
    };
    (0..n).map(of).collect()
}

#[allow(clippy::cast_precision_loss)]
fn mancino_start(n: usize) -> Vec<f64> {
    let of = |i: usize| {
        let waves: f64 = (0..n).map(|j| wave(((i + 1) as f64 / (j + 1) as f64).sqrt())).sum();
        -8.710_996e-4 * (math::powi(i as f64 - 49.0, 3) + waves)
    };
    (0..n).map(of).collect()
}

/// Dipole model of the heart: moments up to the third, of two dipoles with coordinates `p` and strengths `a`, `b`.
fn heart<S: Scalar>(x: &[S]) -> Vec<S> {
    let [a, b, c, d, t, u, v, w] = [x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]];
    let (tv, uw) = (sq(t) - sq(v), sq(u) - sq(w));
    let (t3, u3) = (t * (sq(t) - sq(v) * 3.0), u * (sq(u) - sq(w) * 3.0));
    let (v3, w3) = (v * (sq(v) - sq(t) * 3.0), w * (sq(w) - sq(u) * 3.0));
    vec![
        a + b + 0.69,
        c + d + 0.044,
        t * a + u * b - v * c - w * d + 1.57,
        v * a + w * b + t * c + u * d + 1.31,
        a * tv - c * t * v * 2.0 + b * uw - d * u * w * 2.0 + 2.65,
        c * tv + a * t * v * 2.0 + d * uw + b * u * w * 2.0 - 2.0,
        a * t3 + c * v3 + b * u3 + d * w3 + 12.6,
        c * t3 - a * v3 + d * u3 - b * w3 - 9.48,
    ]
}
