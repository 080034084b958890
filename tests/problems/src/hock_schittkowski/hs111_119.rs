//! Problems 111 to 119: ten to sixteen variables.

use mops_language::Scalar;

use super::common::hs113;
use super::hs071_086::colville;
use super::notation::{hs, within};
use crate::arithmetic::{c, cube, dot, sq, sum};
use crate::formula::Functions;
use crate::problem::Problem;

pub(super) fn problems() -> Vec<(u32, Problem)> {
    let alkylation: [[f64; 3]; 10] = [
        [1745.0, 1e-5, 2e3],
        [12000.0, 1e-5, 1.6e4],
        [110.0, 1e-5, 120.0],
        [3048.0, 1e-5, 5e3],
        [1974.0, 1e-5, 2e3],
        [89.2, 85.0, 93.0],
        [92.8, 90.0, 95.0],
        [8.0, 3.0, 12.0],
        [3.6, 1.2, 4.0],
        [145.0, 145.0, 162.0],
    ];
    let mut shell = [0.001; 15];
    shell[6] = 60.0;
    vec![
        within(&[[-100.0, 100.0]; 10], hs(111, &[-2.3; 10], [0, 3], -47.7610909, Functions::of(hs111, hs111))),
        within(&[[1e-6, f64::INFINITY]; 10], hs(112, &[0.1; 10], [0, 3], -47.7610909, Functions::of(hs112, hs112))),
        hs(113, &[2.0, 3.0, 5.0, 5.0, 1.0, 2.0, 7.0, 3.0, 6.0, 10.0], [8, 0], 24.30620907, Functions::of(hs113, hs113)),
        within(
            &alkylation.map(|[_, low, high]| [low, high]),
            hs(114, &alkylation.map(|v| v[0]), [8, 3], -1768.806964, Functions::of(hs114, hs114)),
        ),
        within(
            &MEMBRANE.map(|[_, low, high]| [low, high]),
            hs(116, &MEMBRANE.map(|v| v[0]), [15, 0], 97.58750956, Functions::of(hs116, hs116)),
        ),
        within(&[[0.0, 100.0]; 15], hs(117, &shell, [5, 0], 32.34867897, Functions::of(hs117, hs117))),
        within(&quarters(), hs(118, &QUARTERS, [29, 0], 664.82045, Functions::of(hs118, hs118))),
        within(&[[0.0, 5.0]; 16], hs(119, &[10.0; 16], [0, 8], 244.899698, Functions::of(hs119, hs119))),
    ]
}

/// Free energies of ten substances made of three elements.
const ENERGY: [f64; 10] = [-6.089, -17.164, -34.054, -5.914, -24.721, -14.986, -24.1, -10.708, -26.662, -22.179];

/// Balance of the elements.
fn elements<S: Scalar>(n: &[S]) -> [S; 3] {
    [
        dot(&[1.0, 2.0, 2.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], n) - 2.0,
        dot(&[0.0, 0.0, 0.0, 1.0, 2.0, 1.0, 1.0], n) - 1.0,
        dot(&[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 1.0], n) - 1.0,
    ]
}

/// Chemical equilibrium in logarithmic variables.
fn hs111<S: Scalar>(x: &[S]) -> Vec<S> {
    let n: Vec<S> = x.iter().map(|x| x.exp()).collect();
    let total = sum(n.iter().copied()).ln();
    let f = sum((0..10).map(|j| n[j] * (x[j] - total + ENERGY[j])));
    [vec![f], elements(&n).to_vec()].concat()
}

/// Chemical equilibrium.
fn hs112<S: Scalar>(x: &[S]) -> Vec<S> {
    let total = sum(x.iter().copied());
    let f = sum(x.iter().zip(ENERGY).map(|(&x, energy)| x * ((x / total).ln() + energy)));
    [vec![f], elements(x).to_vec()].concat()
}

/// Alkylation.
fn hs114<S: Scalar>(x: &[S]) -> Vec<S> {
    const A: f64 = 0.99;
    const B: f64 = 0.9;
    let f = x[0] * 5.04 + x[1] * 0.035 + x[2] * 10.0 + x[4] * 3.36 - x[3] * x[6] * 0.063;
    let g1 = -x[9] * 0.222 - x[8] * B + 35.82;
    let g2 = x[6] * 3.0 - x[9] * A - 133.0;
    let g5 = x[0] * 1.12 + x[0] * x[7] * 0.13167 - x[0] * sq(x[7]) * 0.00667 - x[3] * A;
    let g6 = x[7] * 1.098 - sq(x[7]) * 0.038 + x[5] * 0.325 - x[6] * A + 57.425;
    let slack = 1.0 / A - A;
    let inequalities =
        [g1, g2, -g1 + x[8] * (1.0 / B - B), -g2 + x[9] * slack, g5, g6, -g5 + x[3] * slack, -g6 + x[6] * slack];
    let equalities =
        [x[3] * 1.22 - x[0] - x[4], x[2] * 98000.0 / (x[3] * x[8] + x[2] * 1000.0) - x[5], (x[1] + x[4]) / x[0] - x[7]];
    [vec![f], inequalities.map(|g| -g).to_vec(), equalities.to_vec()].concat()
}

/// Initial guess, lower and upper bound.
const MEMBRANE: [[f64; 3]; 13] = [
    [0.5, 0.1, 1.0],
    [0.8, 0.1, 1.0],
    [0.9, 0.1, 1.0],
    [0.1, 1e-4, 0.1],
    [0.14, 0.1, 0.9],
    [0.5, 0.1, 0.9],
    [489.0, 0.1, 1000.0],
    [80.0, 0.1, 1000.0],
    [650.0, 500.0, 1000.0],
    [450.0, 0.1, 500.0],
    [150.0, 1.0, 150.0],
    [150.0, 1e-4, 150.0],
    [150.0, 1e-4, 150.0],
];

/// Separation by membranes in three stages.
fn hs116<S: Scalar>(x: &[S]) -> Vec<S> {
    let f = x[10] + x[11] + x[12];
    let stage = |feed: S, product: S| product - feed * 0.03475 - feed * product * 0.975 + sq(feed) * 0.00975;
    let power = |purity: S, flow: S, power: S| power - flow * 1.262626 + purity * flow * 1.231059;
    let inequalities = [
        x[2] - x[1],
        x[1] - x[0],
        (x[7] - x[6]) * 0.002 + 1.0,
        f - 50.0,
        -f + 250.0,
        power(x[2], x[9], x[12]),
        stage(x[1], x[4]),
        stage(x[2], x[5]),
        x[4] * x[6] - x[0] * x[7] - x[3] * x[6] + x[3] * x[7],
        -(x[1] * x[8] + x[4] * x[7] - x[0] * x[7] - x[5] * x[8]) * 0.002 - x[4] - x[5] + 1.0,
        x[1] * x[8] - x[2] * x[9] - x[5] * x[8] - x[1] * 500.0 + x[5] * 500.0 + x[1] * x[9],
        x[1] - (x[1] * x[9] - x[2] * x[9]) * 0.002 - 0.9,
        stage(x[0], x[3]),
        power(x[0], x[7], x[10]),
        power(x[1], x[8], x[11]),
    ];
    [vec![f], inequalities.map(|g| -g).to_vec()].concat()
}

/// Dual of problem 86.
fn hs117<S: Scalar>(x: &[S]) -> Vec<S> {
    let (y, z) = x.split_at(10);
    let quadratic = sum(colville::C.iter().zip(z).map(|(row, &z_i)| z_i * dot(row, z)));
    let cubic = sum(colville::D.iter().zip(z).map(|(&d, &z)| cube(z) * (2.0 * d)));
    let row = |j: usize| {
        let column: Vec<f64> = colville::A.iter().map(|a| a[j]).collect();
        -(dot(&colville::C[j], z) * 2.0 + sq(z[j]) * (3.0 * colville::D[j]) + colville::E[j] - dot(&column, y))
    };
    std::iter::once(-dot(&colville::B, y) + quadratic + cubic).chain((0..5).map(row)).collect()
}

const QUARTERS: [f64; 15] = [20.0, 55.0, 15.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0];

fn quarters() -> Vec<[f64; 2]> {
    let first = vec![[8.0, 21.0], [43.0, 57.0], [3.0, 16.0]];
    [first, [[0.0, 90.0], [0.0, 120.0], [0.0, 60.0]].repeat(4)].concat()
}

/// Production over five quarters.
fn hs118<S: Scalar>(x: &[S]) -> Vec<S> {
    let cost = |k: usize| {
        let (a, b, c) = (x[3 * k], x[3 * k + 1], x[3 * k + 2]);
        a * 2.3 + sq(a) * 0.0001 + b * 1.7 + sq(b) * 0.0001 + c * 2.2 + sq(c) * 0.00015
    };
    let mut rows = vec![sum((0..5).map(cost))];
    for i in 3..15 {
        let change = x[i] - x[i - 3] + 7.0;
        rows.extend([-change, change - [13.0, 14.0, 13.0][i % 3]]);
    }
    let demand = [60.0, 50.0, 70.0, 85.0, 100.0];
    rows.extend((0..5).map(|k| -(x[3 * k] + x[3 * k + 1] + x[3 * k + 2]) + demand[k]));
    rows
}

/// Pairs of variables whose terms are multiplied in the objective of problem 119, counted from 1, besides the squares.
const PAIRS: [(usize, usize); 30] = [
    (1, 4),
    (1, 7),
    (1, 8),
    (1, 16),
    (2, 3),
    (2, 7),
    (2, 10),
    (3, 7),
    (3, 9),
    (3, 10),
    (3, 14),
    (4, 7),
    (4, 11),
    (4, 15),
    (5, 6),
    (5, 10),
    (5, 12),
    (5, 16),
    (6, 8),
    (6, 15),
    (7, 11),
    (7, 13),
    (8, 10),
    (8, 15),
    (9, 12),
    (9, 16),
    (10, 14),
    (11, 13),
    (12, 14),
    (13, 14),
];

/// Colville's seventh problem.
fn hs119<S: Scalar>(x: &[S]) -> Vec<S> {
    const B: [[f64; 8]; 8] = [
        [0.22, 0.20, 0.19, 0.25, 0.15, 0.11, 0.12, 0.13],
        [-1.46, 0.0, -1.30, 1.82, -1.15, 0.0, 0.80, 0.0],
        [1.29, -0.89, 0.0, 0.0, -1.16, -0.96, 0.0, -0.49],
        [-1.10, -1.06, 0.95, -0.54, 0.0, -1.78, -0.41, 0.0],
        [0.0, 0.0, 0.0, -1.43, 1.51, 0.59, -0.33, -0.43],
        [0.0, -1.72, -0.33, 0.0, 1.62, 1.24, 0.21, -0.26],
        [1.12, 0.0, 0.0, 0.31, 0.0, 0.0, 1.12, 0.0],
        [0.0, 0.45, 0.26, -1.10, 0.58, 0.0, -1.03, 0.10],
    ];
    const LEVEL: [f64; 8] = [2.5, 1.1, -3.1, -3.5, 1.3, 2.1, 2.3, -1.5];
    let p: Vec<S> = x.iter().map(|&x| sq(x) + x + 1.0).collect();
    let pairs = sum(PAIRS.iter().map(|&(i, j)| p[i - 1] * p[j - 1]));
    let f = sum(p.iter().map(|&p| sq(p))) + pairs;
    // Every equality has a variable of its own, with coefficient 1; the seventh has a further one.
    let extra = |k: usize| if k == 6 { x[8] * -0.36 } else { c(0.0) };
    let row = |k: usize| dot(&B[k], &x[..8]) + x[8 + k] + extra(k) - LEVEL[k];
    std::iter::once(f).chain((0..8).map(row)).collect()
}
