//! Problems 101 to 110: seven to ten variables.

use mops_language::Scalar;
use mops_math as math;

use super::notation::{POSITIVE, hs, within};
use crate::arithmetic::{cube, sq, sum};
use crate::formula::Functions;
use crate::problem::Problem;

pub(super) fn problems() -> Vec<(u32, Problem)> {
    let geometric = [[[0.1, 10.0]; 6].to_vec(), vec![[0.01, 10.0]]].concat();
    let free = [f64::NEG_INFINITY, f64::INFINITY];
    let exchangers = [[[100.0, 1e4], [1e3, 1e4], [1e3, 1e4]].to_vec(), vec![[10.0, 1e3]; 5]].concat();
    let power = [vec![POSITIVE; 2], vec![free; 2], vec![[0.90909, 1.0909]; 3], vec![free; 2]].concat();
    let hexagon = [vec![free; 8], vec![POSITIVE]].concat();
    let grid =
        [vec![[0.0, 1500.0]; 2], vec![[-0.55, 0.55]; 2], vec![[196.0, 252.0]; 3], vec![[-400.0, 800.0]; 2]].concat();
    vec![
        within(&geometric, hs(101, &[6.0; 7], [6, 0], 1809.76476, Functions::of(hs101, hs101))),
        within(&geometric, hs(102, &[6.0; 7], [6, 0], 911.88053, Functions::of(hs102, hs102))),
        within(&geometric, hs(103, &[6.0; 7], [6, 0], 543.66794, Functions::of(hs103, hs103))),
        within(
            &[[0.1, 10.0]; 8],
            hs(104, &[6.0, 3.0, 0.4, 0.2, 6.0, 6.0, 1.0, 0.5], [6, 0], 3.951163439, Functions::of(hs104, hs104)),
        ),
        within(
            &exchangers,
            hs(
                106,
                &[5e3, 5e3, 5e3, 200.0, 350.0, 150.0, 225.0, 425.0],
                [6, 0],
                7049.248021,
                Functions::of(hs106, hs106),
            ),
        ),
        within(
            &power,
            hs(
                107,
                &[0.8, 0.8, 0.2, 0.2, 1.0454, 1.0454, 1.0454, 0.0, 0.0],
                [0, 6],
                5055.011803,
                Functions::of(hs107, hs107),
            ),
        ),
        within(&hexagon, hs(108, &[1.0; 9], [13, 0], [-0.8660254038, -0.6749814, -0.5], Functions::of(hs108, hs108))),
        within(&grid, hs(109, &[0.0; 9], [4, 6], 5362.0692, Functions::of(hs109, hs109))),
        within(&[[2.001, 9.999]; 10], hs(110, &[9.0; 10], [0, 0], -45.77846971, Functions::of(hs110, hs110))),
    ]
}

/// Monomial: the product of powers.
fn power<S: Scalar>(factor: f64, x: &[S], exponents: &[f64]) -> S {
    let used = x.iter().zip(exponents).filter(|(_, e)| **e != 0.0);
    used.fold(S::from(factor), |product, (x, &e)| product * x.powf(e))
}

/// Geometric program; the problems differ in one exponent.
fn geometric<S: Scalar>(x: &[S], a: f64) -> Vec<S> {
    let p = |factor: f64, exponents: [f64; 7]| power(factor, x, &exponents);
    let third = 1.0 / 3.0;
    let f = p(10.0, [1.0, -1.0, 0.0, 2.0, 0.0, -3.0, a])
        + p(15.0, [-1.0, -2.0, 1.0, 1.0, -1.0, 0.0, -0.5])
        + p(20.0, [-2.0, 1.0, 0.0, -1.0, -2.0, 1.0, 0.0])
        + p(25.0, [2.0, 2.0, -1.0, 0.0, 0.5, -2.0, 1.0]);
    vec![
        f,
        p(0.5, [0.5, 0.0, -1.0, 0.0, 0.0, -2.0, 1.0])
            + p(0.7, [3.0, 1.0, -2.0, 0.0, 0.0, 1.0, 0.5])
            + p(0.2, [0.0, -1.0, 1.0, -0.5, 0.0, 2.0 * third, 0.25])
            - 1.0,
        p(1.3, [-0.5, 1.0, -1.0, 0.0, -1.0, 1.0, 0.0])
            + p(0.8, [0.0, 0.0, 1.0, -1.0, -1.0, 2.0, 0.0])
            + p(3.1, [-1.0, 0.5, 0.0, -2.0, -1.0, third, 0.0])
            - 1.0,
        p(2.0, [1.0, 0.0, -1.5, 0.0, 1.0, -1.0, third])
            + p(0.1, [0.0, 1.0, -0.5, 0.0, 1.0, -1.0, -0.5])
            + p(1.0, [-1.0, 1.0, 0.5, 0.0, 1.0, 0.0, 0.0])
            + p(0.65, [0.0, -2.0, 1.0, 0.0, 1.0, -1.0, 1.0])
            - 1.0,
        p(0.2, [-2.0, 1.0, 0.0, -1.0, 0.5, 0.0, third])
            + p(0.3, [0.5, 2.0, 1.0, third, -2.0 * third, 0.0, 0.25])
            + p(0.4, [-3.0, -2.0, 1.0, 0.0, 1.0, 0.0, 0.75])
            + p(0.5, [0.0, 0.0, -2.0, 1.0, 0.0, 0.0, 0.5])
            - 1.0,
        -f + 100.0,
        f - 3000.0,
    ]
}

fn hs101<S: Scalar>(x: &[S]) -> Vec<S> {
    geometric(x, -0.25)
}

fn hs102<S: Scalar>(x: &[S]) -> Vec<S> {
    geometric(x, 0.125)
}

fn hs103<S: Scalar>(x: &[S]) -> Vec<S> {
    geometric(x, 0.5)
}

/// Two reactors in series.
fn hs104<S: Scalar>(x: &[S]) -> Vec<S> {
    let f = (x[0] / x[6]).powf(0.67) * 0.4 + (x[1] / x[7]).powf(0.67) * 0.4 - x[0] - x[1] + 10.0;
    let reactor =
        |i: usize| (x[i] * 4.0 + x[i].powf(-0.71) * 2.0) / x[i + 2] + x[i].powf(-1.3) * x[i + 4] * 0.0588 - 1.0;
    vec![
        f,
        x[4] * x[6] * 0.0588 + x[0] * 0.1 - 1.0,
        x[5] * x[7] * 0.0588 + (x[0] + x[1]) * 0.1 - 1.0,
        reactor(2),
        reactor(3),
        -f + 1.0,
        f - 4.2,
    ]
}

/// Three heat exchangers.
fn hs106<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        x[0] + x[1] + x[2],
        (x[3] + x[5]) * 0.0025 - 1.0,
        (x[4] + x[6] - x[3]) * 0.0025 - 1.0,
        (x[7] - x[4]) * 0.01 - 1.0,
        -x[0] * x[5] + x[3] * 833.33252 + x[0] * 100.0 - 83333.333,
        -x[1] * x[6] + x[4] * 1250.0 + x[1] * x[3] - x[3] * 1250.0,
        -x[2] * x[7] + x[2] * x[4] - x[4] * 2500.0 + 1_250_000.0,
    ]
}

/// Power flow: three nodes.
fn hs107<S: Scalar>(x: &[S]) -> Vec<S> {
    let (sin, cos) = math::sin_cos(0.25);
    let (c, d) = (48.4 / 50.176 * sin, 48.4 / 50.176 * cos);
    let ((y1, y2), (y3, y4), (y5, y6)) = (x[7].sin_cos(), x[8].sin_cos(), (x[7] - x[8]).sin_cos());
    let (v, w, z) = (x[4], x[5], x[6]);
    vec![
        x[0] * 3000.0 + cube(x[0]) * 1000.0 + x[1] * 2000.0 + cube(x[1]) * 666.667,
        -x[0] + sq(v) * (2.0 * c) - v * w * (y1 * d + y2 * c) - v * z * (y3 * d + y4 * c) + 0.4,
        -x[1] + sq(w) * (2.0 * c) + v * w * (y1 * d - y2 * c) + w * z * (y5 * d - y6 * c) + 0.4,
        sq(z) * (2.0 * c) + v * z * (y3 * d - y4 * c) - w * z * (y5 * d + y6 * c) + 0.8,
        -x[2] + sq(v) * (2.0 * d) + v * w * (y1 * c - y2 * d) + v * z * (y3 * c - y4 * d) + 0.2,
        -x[3] + sq(w) * (2.0 * d) - v * w * (y1 * c + y2 * d) - w * z * (y5 * c + y6 * d) + 0.2,
        sq(z) * (2.0 * d) - v * z * (y3 * c + y4 * d) + w * z * (y5 * c - y6 * d) - 0.337,
    ]
}

/// Largest hexagon of diameter 1; one vertex is the origin.
fn hs108<S: Scalar>(x: &[S]) -> Vec<S> {
    let apart = |a: S, b: S| sq(a) + sq(b) - 1.0;
    let (t1, t2, t3, t4) = (x[0] * x[3] - x[1] * x[2], x[2] * x[8], -x[4] * x[8], x[4] * x[7] - x[5] * x[6]);
    let mut rows = vec![
        (t1 + t2 + t3 + t4) * -0.5,
        apart(x[2], x[3]),
        sq(x[8]) - 1.0,
        apart(x[4], x[5]),
        apart(x[0], x[1] - x[8]),
        apart(x[0] - x[4], x[1] - x[5]),
        apart(x[0] - x[6], x[1] - x[7]),
        apart(x[2] - x[4], x[3] - x[5]),
        apart(x[2] - x[6], x[3] - x[7]),
        apart(x[6], x[7] - x[8]),
    ];
    rows.extend([-t1, -t2, -t3, -t4]);
    rows
}

/// Power flow: generators with limits on apparent power.
fn hs109<S: Scalar>(x: &[S]) -> Vec<S> {
    const A: f64 = 50.176;
    let (b, c) = math::sin_cos(0.25);
    let (u, v, w) = (x[4], x[5], x[6]);
    let sin = |angle: S| (angle - 0.25).sin();
    let cos = |angle: S| (angle - 0.25).cos();
    let loss = |u: S| sq(u) * (0.7533e-3 * A - 2.0 * c);
    vec![
        x[0] * 3.0 + cube(x[0]) * 1e-6 + x[1] * 2.0 + cube(x[1]) * 0.522074e-6,
        x[2] - x[3] - 0.55,
        x[3] - x[2] - 0.55,
        sq(x[0]) + sq(x[7]) - 2.25e6,
        sq(x[1]) + sq(x[8]) - 2.25e6,
        u * v * sin(-x[2]) + u * w * sin(-x[3]) + sq(u) * (2.0 * b) - x[0] * A + 400.0 * A,
        u * v * sin(x[2]) + v * w * sin(x[2] - x[3]) + sq(v) * (2.0 * b) - x[1] * A + 400.0 * A,
        u * w * sin(x[3]) + v * w * sin(x[3] - x[2]) + sq(w) * (2.0 * b) + 881.779 * A,
        x[7] * A + u * v * cos(-x[2]) + u * w * cos(-x[3]) - 200.0 * A + loss(u),
        x[8] * A + u * v * cos(x[2]) + v * w * cos(x[2] - x[3]) - 200.0 * A + loss(v),
        u * w * cos(x[3]) + v * w * cos(x[3] - x[2]) + 22.938 * A + loss(w),
    ]
}

fn hs110<S: Scalar>(x: &[S]) -> Vec<S> {
    let logarithms = sum(x.iter().map(|&x| sq((x - 2.0).ln()) + sq((-x + 10.0).ln())));
    let product = x.iter().skip(1).fold(x[0], |product, &x| product * x);
    vec![logarithms - product.powf(0.2)]
}
