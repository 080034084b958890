//! Problems 61 to 69: three and four variables.

use mops_language::Scalar;

use super::notation::{POSITIVE, hs, within};
use crate::arithmetic::{c, dot, normal, sq, sum};
use crate::formula::Functions;
use crate::problem::Problem;

pub(super) fn problems() -> Vec<(u32, Problem)> {
    let inspection = [[1e-4, 100.0], [0.0, 100.0], [0.0, 2.0], [0.0, 2.0]];
    let plant = [[1e-5, 2e3], [1e-5, 1.6e4], [1e-5, 120.0]];
    vec![
        hs(61, &[0.0; 3], [0, 2], -143.6461422, Functions::of(hs61, hs61)),
        within(&[[0.0, 1.0]; 3], hs(62, &[0.7, 0.2, 0.1], [0, 1], -26272.51449, Functions::of(hs62, hs62))),
        within(&[POSITIVE; 3], hs(63, &[2.0; 3], [0, 2], 961.7151721, Functions::of(hs63, hs63))),
        within(&[[1e-5, 1e3]; 3], hs(64, &[1.0; 3], [1, 0], 6299.842428, Functions::of(hs64, hs64))),
        within(
            &[[-4.5, 4.5], [-4.5, 4.5], [-5.0, 5.0]],
            hs(65, &[-5.0, 5.0, 0.0], [1, 0], 0.9535288568, Functions::of(hs65, hs65)),
        ),
        within(
            &[[0.0, 100.0], [0.0, 100.0], [0.0, 10.0]],
            hs(66, &[0.0, 1.05, 2.9], [2, 0], 0.5181632742, Functions::of(hs66, hs66)),
        ),
        within(&plant, hs(67, &[1745.0, 12000.0, 110.0], [14, 0], -1162.02698, Functions::of(hs67, hs67))),
        within(&inspection, hs(68, &[1.0; 4], [0, 2], -0.92042516, Functions::of(hs68, hs68))),
        within(&inspection, hs(69, &[1.0; 4], [0, 2], -956.712887, Functions::of(hs69, hs69))),
    ]
}

fn hs61<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        sq(x[0]) * 4.0 + sq(x[1]) * 2.0 + sq(x[2]) * 2.0 + dot(&[-33.0, 16.0, -24.0], x),
        x[0] * 3.0 - sq(x[1]) * 2.0 - 7.0,
        x[0] * 4.0 - sq(x[2]) - 11.0,
    ]
}

fn hs62<S: Scalar>(x: &[S]) -> Vec<S> {
    let ratio = |share: f64, x: &[S]| {
        let rest = sum(x[1..].iter().copied()) + 0.03;
        ((x[0] + rest) / (x[0] * share + rest)).ln()
    };
    let f = ratio(0.09, x) * 255.0 + ratio(0.07, &x[1..]) * 280.0 + ratio(0.13, &x[2..]) * 290.0;
    vec![f * -32.174, sum(x.iter().copied()) - 1.0]
}

fn hs63<S: Scalar>(x: &[S]) -> Vec<S> {
    let (a, b, c) = (sq(x[0]), sq(x[1]), sq(x[2]));
    vec![-a - b * 2.0 - c - x[0] * x[1] - x[0] * x[2] + 1000.0, dot(&[8.0, 14.0, 7.0], x) - 56.0, a + b + c - 25.0]
}

fn hs64<S: Scalar>(x: &[S]) -> Vec<S> {
    let over = [x[0], x[1], x[2]].map(|x| c::<S>(1.0) / x);
    vec![dot(&[5.0, 20.0, 10.0], x) + dot(&[50000.0, 72000.0, 144000.0], &over), dot(&[4.0, 32.0, 120.0], &over) - 1.0]
}

fn hs65<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0] - x[1]) + sq(x[0] + x[1] - 10.0) / 9.0 + sq(x[2] - 5.0), sum(x.iter().map(|&x| sq(x))) - 48.0]
}

fn hs66<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![x[2] * 0.2 - x[0] * 0.8, x[0].exp() - x[1], x[1].exp() - x[2]]
}

/// Alkylation with both iteration loops solved to their fixed points, so that the functions are smooth; the book stops
/// the loops at 0.001.
fn hs67<S: Scalar>(x: &[S]) -> Vec<S> {
    let mut y2 = x[0] * 1.6;
    let (mut y3, mut y6) = (x[0], x[0]);
    for _ in 0..200 {
        y3 = y2 * 1.22 - x[0];
        y6 = (x[1] + y3) / x[0];
        y2 = x[0] * (y6 * 13.167 - sq(y6) * 0.6667 + 112.0) * 0.01;
    }
    let mut y4 = c::<S>(93.0);
    let (mut y5, mut y7, mut y8) = (y4, y4, y4);
    for _ in 0..200 {
        y5 = y6 * 1.098 - sq(y6) * 0.038 + (y4 - 89.0) * 0.325 + 86.35;
        y8 = y5 * 3.0 - 133.0;
        y7 = -y8 * 0.222 + 35.82;
        y4 = x[2] * 98000.0 / (y2 * y7 + x[2] * 1000.0);
    }
    let f = -(y2 * y5 * 0.063 - x[0] * 5.04 - y3 * 3.36 - x[1] * 0.035 - x[2] * 10.0);
    let limits = [
        (y2, 0.0, 5000.0),
        (y3, 0.0, 2000.0),
        (y4, 85.0, 93.0),
        (y5, 90.0, 95.0),
        (y6, 3.0, 12.0),
        (y7, 0.01, 4.0),
        (y8, 145.0, 162.0),
    ];
    std::iter::once(f).chain(limits.into_iter().flat_map(|(y, low, high)| [-y + low, y - high])).collect()
}

/// Inspection at minimum cost.
fn inspection<S: Scalar>(x: &[S], a: f64, b: f64, n: f64) -> Vec<S> {
    let growth = x[0].exp() - 1.0;
    vec![
        (-(growth * b - x[2]) * x[3] / (growth + x[3]) + a * n) / x[0],
        x[2] - normal(-x[1]) * 2.0,
        x[3] - normal(-x[1] + n.sqrt()) - normal(-x[1] - n.sqrt()),
    ]
}

fn hs68<S: Scalar>(x: &[S]) -> Vec<S> {
    inspection(x, 1e-4, 1.0, 24.0)
}

fn hs69<S: Scalar>(x: &[S]) -> Vec<S> {
    inspection(x, 0.1, 1000.0, 4.0)
}
