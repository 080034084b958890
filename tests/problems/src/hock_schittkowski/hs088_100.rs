//! Problems 88 to 100: two to seven variables.

use mops_language::Scalar;
use mops_math as math;

use super::common::hs100;
use super::notation::{POSITIVE, hs, within};
use crate::arithmetic::{c, dot, sq, sum};
use crate::formula::Functions;
use crate::problem::Problem;

pub(super) fn problems() -> Vec<(u32, Problem)> {
    let mixture = [0.31, 0.046, 0.068, 0.042, 0.028, 0.0134].map(|high| [0.0, high]);
    let alternating = [0.5, -0.5, 0.5, -0.5, 0.5, -0.5];
    let heat = |number: u32| {
        let n = number as usize - 86;
        let answer = 1.36264622;
        within(&vec![[-10.0, 10.0]; n], hs(number, &alternating[..n], [1, 0], answer, Functions::of(heating, heating)))
    };
    let mut all: Vec<(u32, Problem)> = (88..=92).map(heat).collect();
    all.extend([
        within(
            &[POSITIVE; 6],
            hs(93, &[5.54, 4.4, 12.02, 11.82, 0.702, 0.852], [2, 0], 135.075961, Functions::of(hs93, hs93)),
        ),
        within(&mixture, hs(95, &[0.0; 6], [4, 0], 0.01561952524, Functions::of(hs95, hs95))),
        within(&mixture, hs(96, &[0.0; 6], [4, 0], 0.01561952524, Functions::of(hs96, hs96))),
        within(&mixture, hs(97, &[0.0; 6], [4, 0], [3.135809123, 4.07124640], Functions::of(hs97, hs97))),
        within(&mixture, hs(98, &[0.0; 6], [4, 0], [3.135809123, 4.07124640], Functions::of(hs98, hs98))),
        within(&[[0.0, 1.58]; 7], hs(99, &[0.5; 7], [0, 2], -831079891.5, Functions::of(hs99, hs99))),
        hs(100, &[1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0], [4, 0], 680.6300574, Functions::of(hs100, hs100)),
    ]);
    all
}

/// Minimum control energy that heats a rod to within 1e-4, with switching times `x^2`. The constraint is the mean
/// square deviation of a Fourier series of 30 terms, whose frequencies solve `mu tan mu = 1`.
#[allow(clippy::cast_precision_loss)]
fn heating<S: Scalar>(x: &[S]) -> Vec<S> {
    let terms: Vec<(f64, f64, S)> = (0..30)
        .map(|k| {
            let mu = frequency(f64::from(k));
            let (sin, cos) = math::sin_cos(mu);
            (mu, 2.0 * sin / (mu + sin * cos), response(mu, x))
        })
        .collect();
    let mut deviation = c::<S>(2.0 / 15.0);
    for (i, &(mu, a, rho)) in terms.iter().enumerate() {
        let (sin, cos) = math::sin_cos(mu);
        deviation += sq(rho) * (math::powi(mu, 4) * a * a * (math::sin(2.0 * mu) / (2.0 * mu) + 1.0) / 2.0);
        deviation -= rho * (mu * mu * a * (2.0 * sin / math::powi(mu, 3) - 2.0 * cos / (mu * mu)));
        for &(nu, b, sigma) in &terms[i + 1..] {
            let overlap = math::sin(mu + nu) / (mu + nu) + math::sin(mu - nu) / (mu - nu);
            deviation += rho * sigma * (mu * mu * nu * nu * a * b * overlap);
        }
    }
    vec![sum(x.iter().map(|&x| sq(x))), deviation - 1e-4]
}

/// Solution of `mu tan mu = 1` between `k pi` and `k pi + pi/2`.
fn frequency(k: f64) -> f64 {
    let mut mu = k * std::f64::consts::PI + if k == 0.0 { 0.86 } else { 1.0 / (k * std::f64::consts::PI) };
    for _ in 0..20 {
        let (sin, cos) = math::sin_cos(mu);
        mu -= (mu * sin - cos) / (mu * cos + 2.0 * sin);
    }
    mu
}

/// `-(exp(-mu^2 (x_1^2 + ... + x_n^2)) - 2 exp(-mu^2 (x_2^2 + ... )) + ... + (-1)^n) / mu^2`.
fn response<S: Scalar>(mu: f64, x: &[S]) -> S {
    let mut sign = 1.0;
    let mut total = c::<S>(0.0);
    for first in 0..x.len() {
        let factor = if first == 0 { sign } else { 2.0 * sign };
        total += (sum(x[first..].iter().map(|&x| sq(x))) * (-mu * mu)).exp() * factor;
        sign = -sign;
    }
    -(total + sign) / (mu * mu)
}

fn hs93<S: Scalar>(x: &[S]) -> Vec<S> {
    let iron = x[0] * x[3] * (x[0] + x[1] + x[2]);
    let copper = x[1] * x[2] * (x[0] + x[1] * 1.57 + x[3]);
    vec![
        iron * 0.0204 + copper * 0.0187 + iron * sq(x[4]) * 0.0607 + copper * sq(x[5]) * 0.0437,
        x[0] * x[1] * x[2] * x[3] * x[4] * x[5] * -0.001 + 2.07,
        iron * sq(x[4]) * 0.00062 + copper * sq(x[5]) * 0.00058 - 1.0,
    ]
}

fn mixture<S: Scalar>(x: &[S], b: [f64; 4]) -> Vec<S> {
    vec![
        dot(&[4.3, 31.8, 63.3, 15.8, 68.5, 4.7], x),
        -(dot(&[17.1, 38.2, 204.2, 212.3, 623.4, 1495.5], x)
            - x[0] * x[2] * 169.0
            - x[2] * x[4] * 3580.0
            - x[3] * x[4] * 3810.0
            - x[3] * x[5] * 18500.0
            - x[4] * x[5] * 24300.0)
            + b[0],
        -(dot(&[17.9, 36.8, 113.9, 169.7, 337.8, 1385.2], x)
            - x[0] * x[2] * 139.0
            - x[3] * x[4] * 2450.0
            - x[3] * x[5] * 16600.0
            - x[4] * x[5] * 17200.0)
            + b[1],
        x[1] * 273.0 + x[3] * 70.0 + x[4] * 819.0 - x[3] * x[4] * 26000.0 + b[2],
        -dot(&[159.9, -311.0, 0.0, 587.0, 391.0, 2198.0], x) + x[0] * x[5] * 14000.0 + b[3],
    ]
}

fn hs95<S: Scalar>(x: &[S]) -> Vec<S> {
    mixture(x, [4.97, -1.88, -29.08, -78.02])
}

fn hs96<S: Scalar>(x: &[S]) -> Vec<S> {
    mixture(x, [4.97, -1.88, -69.08, -118.02])
}

fn hs97<S: Scalar>(x: &[S]) -> Vec<S> {
    mixture(x, [32.97, 25.12, -29.08, -78.02])
}

fn hs98<S: Scalar>(x: &[S]) -> Vec<S> {
    mixture(x, [32.97, 25.12, -124.08, -173.02])
}

/// Rocket that must reach altitude 100000 with speed 1000 after 380 s, at maximum range: thrust angles of seven stages.
fn hs99<S: Scalar>(x: &[S]) -> Vec<S> {
    const THRUST: [f64; 7] = [50.0, 50.0, 75.0, 75.0, 75.0, 100.0, 100.0];
    const LASTS: [f64; 7] = [25.0, 25.0, 50.0, 50.0, 50.0, 90.0, 90.0];
    let (mut range, mut height, mut speed) = (c::<S>(0.0), c::<S>(0.0), c::<S>(0.0));
    for ((&angle, thrust), time) in x.iter().zip(THRUST).zip(LASTS) {
        let (sin, cos) = angle.sin_cos();
        let climb = sin * thrust - 32.0;
        range += cos * (thrust * time);
        height += climb * (0.5 * time * time) + speed * time;
        speed += climb * time;
    }
    vec![-sq(range), height - 1e5, speed - 1e3]
}
