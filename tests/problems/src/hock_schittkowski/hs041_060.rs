//! Problems 41 to 60: two to seven variables.

use mops_language::Scalar;
use mops_math as math;

use super::common::hs43;
use super::notation::{POSITIVE, hs, within};
use crate::arithmetic::{cube, dot, fourth, sq, sum};
use crate::formula::Functions;
use crate::problem::Problem;

pub(super) fn problems() -> Vec<(u32, Problem)> {
    let root = 2.0_f64.sqrt();
    let (a, b) = (math::asin((1.0_f64 / 4.2).sqrt()), math::asin((5.0_f64 / 7.2).sqrt()));
    let wide = [-10.0, 10.0];
    vec![
        within(
            &[[0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [0.0, 2.0]],
            hs(41, &[2.0; 4], [0, 1], 52.0 / 27.0, Functions::of(hs41, hs41)),
        ),
        hs(42, &[1.0; 4], [0, 2], 28.0 - 10.0 * root, Functions::of(hs42, hs42)),
        hs(43, &[0.0; 4], [3, 0], -44.0, Functions::of(hs43, hs43)),
        within(&[POSITIVE; 4], hs(44, &[0.0; 4], [6, 0], [-15.0, -13.0], Functions::of(hs44, hs44))),
        within(
            &[1.0, 2.0, 3.0, 4.0, 5.0].map(|high| [0.0, high]),
            hs(45, &[2.0; 5], [0, 0], 1.0, Functions::of(hs45, hs45)),
        ),
        hs(46, &[root / 2.0, 1.75, 0.5, 2.0, 2.0], [0, 2], 0.0, Functions::of(hs46, hs46)),
        hs(47, &[2.0, root, -1.0, 2.0 - root, 0.5], [0, 3], [-0.0267142, 0.0], Functions::of(hs47, hs47)),
        hs(48, &[3.0, 5.0, -3.0, 2.0, -2.0], [0, 2], 0.0, Functions::of(hs48, hs48)),
        hs(49, &[10.0, 7.0, 2.0, -3.0, 0.8], [0, 2], 0.0, Functions::of(hs49, hs49)),
        hs(50, &[35.0, -31.0, 11.0, 5.0, -5.0], [0, 3], 0.0, Functions::of(hs50, hs50)),
        hs(51, &[2.5, 0.5, 2.0, -1.0, 0.5], [0, 3], 0.0, Functions::of(hs51, hs51)),
        hs(52, &[2.0; 5], [0, 3], 1859.0 / 349.0, Functions::of(hs52, hs52)),
        within(&[wide; 5], hs(53, &[2.0; 5], [0, 3], 176.0 / 43.0, Functions::of(hs53, hs53))),
        within(
            &[[0.0, 2e4], wide, [0.0, 1e7], [0.0, 20.0], [-1.0, 1.0], [0.0, 2e8]],
            hs(54, &[6e3, 1.5, 4e6, 2.0, 3e-3, 5e7], [0, 1], -0.90807476, Functions::of(hs54, hs54)),
        ),
        within(
            &[[0.0, 1.0], POSITIVE, POSITIVE, [0.0, 1.0], POSITIVE, POSITIVE],
            hs(55, &[1.0, 2.0, 0.0, 0.0, 0.0, 2.0], [0, 6], [19.0 / 3.0, 20.0 / 3.0], Functions::of(hs55, hs55)),
        ),
        // One period of the angles.
        within(
            &[[[-9.0, 11.0]; 3].to_vec(), vec![[-1.6, 1.6]; 4]].concat(),
            hs(56, &[1.0, 1.0, 1.0, a, a, a, b], [0, 4], -3.456, Functions::of(hs56, hs56)),
        ),
        within(
            &[[0.0, 75.0], [0.0, 65.0]],
            hs(59, &[90.0, 10.0], [3, 0], [-7.8027894, -6.7495053], Functions::of(hs59, hs59)),
        ),
        within(&[wide; 3], hs(60, &[2.0; 3], [0, 1], 0.03256820025, Functions::of(hs60, hs60))),
    ]
}

fn hs41<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![-x[0] * x[1] * x[2] + 2.0, dot(&[1.0, 2.0, 2.0, -1.0], x)]
}

fn hs42<S: Scalar>(x: &[S]) -> Vec<S> {
    let f = sq(x[0] - 1.0) + sq(x[1] - 2.0) + sq(x[2] - 3.0) + sq(x[3] - 4.0);
    vec![f, x[0] - 2.0, sq(x[2]) + sq(x[3]) - 2.0]
}

fn hs44<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        x[0] - x[1] - x[2] - x[0] * x[2] + x[0] * x[3] + x[1] * x[2] - x[1] * x[3],
        x[0] + x[1] * 2.0 - 8.0,
        x[0] * 4.0 + x[1] - 12.0,
        x[0] * 3.0 + x[1] * 4.0 - 12.0,
        x[2] * 2.0 + x[3] - 8.0,
        x[2] + x[3] * 2.0 - 8.0,
        x[2] + x[3] - 5.0,
    ]
}

fn hs45<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![-x[0] * x[1] * x[2] * x[3] * x[4] / 120.0 + 2.0]
}

fn hs46<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        sq(x[0] - x[1]) + sq(x[2] - 1.0) + fourth(x[3] - 1.0) + sq(cube(x[4] - 1.0)),
        sq(x[0]) * x[3] + (x[3] - x[4]).sin() - 1.0,
        x[1] + fourth(x[2]) * sq(x[3]) - 2.0,
    ]
}

fn hs47<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        sq(x[0] - x[1]) + cube(x[1] - x[2]) + fourth(x[2] - x[3]) + fourth(x[3] - x[4]),
        x[0] + sq(x[1]) + cube(x[2]) - 3.0,
        x[1] - sq(x[2]) + x[3] - 1.0,
        x[0] * x[4] - 1.0,
    ]
}

fn hs48<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        sq(x[0] - 1.0) + sq(x[1] - x[2]) + sq(x[3] - x[4]),
        sum(x.iter().copied()) - 5.0,
        x[2] - (x[3] + x[4]) * 2.0 + 3.0,
    ]
}

fn hs49<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        sq(x[0] - x[1]) + sq(x[2] - 1.0) + fourth(x[3] - 1.0) + sq(cube(x[4] - 1.0)),
        dot(&[1.0, 1.0, 1.0, 4.0], x) - 7.0,
        x[2] + x[4] * 5.0 - 6.0,
    ]
}

fn hs50<S: Scalar>(x: &[S]) -> Vec<S> {
    let line = |i: usize| dot(&[1.0, 2.0, 3.0], &x[i..]) - 6.0;
    vec![sq(x[0] - x[1]) + sq(x[1] - x[2]) + fourth(x[2] - x[3]) + sq(x[3] - x[4]), line(0), line(1), line(2)]
}

/// Objective and constraints of problems 51 to 53, which differ in two factors and a constant.
fn linear_quadratic<S: Scalar>(x: &[S], factor: f64, constant: f64) -> Vec<S> {
    vec![
        sq(x[0] * factor - x[1]) + sq(x[1] + x[2] - 2.0) + sq(x[3] - 1.0) + sq(x[4] - 1.0),
        x[0] + x[1] * 3.0 - constant,
        x[2] + x[3] - x[4] * 2.0,
        x[1] - x[4],
    ]
}

fn hs51<S: Scalar>(x: &[S]) -> Vec<S> {
    linear_quadratic(x, 1.0, 4.0)
}

fn hs52<S: Scalar>(x: &[S]) -> Vec<S> {
    linear_quadratic(x, 4.0, 0.0)
}

fn hs53<S: Scalar>(x: &[S]) -> Vec<S> {
    linear_quadratic(x, 1.0, 0.0)
}

fn hs54<S: Scalar>(x: &[S]) -> Vec<S> {
    let (a, b) = ((x[0] - 1e4) / 8e3, x[1] - 1.0);
    let h = (sq(a) + a * b * 0.4 + sq(b)) / 0.96
        + sq(x[2] - 2e6) / (0.96 * 4.9e13)
        + sq(x[3] - 10.0) / 2.5e3
        + sq(x[4] - 1e-3) / 2.5e-3
        + sq(x[5] - 1e8) / 2.5e17;
    vec![-(h * -0.5).exp(), x[0] + x[1] * 4e3 - 1.76e4]
}

fn hs55<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        x[0] + x[1] * 2.0 + x[4] * 4.0 + (x[0] * x[3]).exp(),
        x[0] + x[1] * 2.0 + x[4] * 5.0 - 6.0,
        x[0] + x[1] + x[2] - 3.0,
        x[3] + x[4] + x[5] - 2.0,
        x[0] + x[3] - 1.0,
        x[1] + x[4] - 2.0,
        x[2] + x[5] - 2.0,
    ]
}

fn hs56<S: Scalar>(x: &[S]) -> Vec<S> {
    let side = |i: usize| x[i] - sq(x[i + 3].sin()) * 4.2;
    vec![-x[0] * x[1] * x[2], side(0), side(1), side(2), dot(&[1.0, 2.0, 2.0], x) - sq(x[6].sin()) * 7.2]
}

fn hs59<S: Scalar>(x: &[S]) -> Vec<S> {
    let (x, y) = (x[0], x[1]);
    let (x2, x3, y2, y3) = (sq(x), cube(x), sq(y), cube(y));
    let f = x * 3.8112 - x2 * 0.12694 + x3 * 2.0567e-3 - sq(x2) * 1.0345e-5 + y * 6.8306 - x * y * 0.030234
        + y * x2 * 1.28134e-3
        - y * x3 * 3.5256e-5
        + y * sq(x2) * 2.266e-7
        - y2 * 0.25645
        + y3 * 3.4604e-3
        - sq(y2) * 1.3514e-5
        + S::from(28.106) / (y + 1.0)
        + x2 * y2 * 5.2375e-6
        + x3 * y2 * 6.3e-8
        - x3 * y3 * 7e-10
        - x * y2 * 3.405e-4
        + x * y3 * 1.6638e-6
        + (x * y * 0.0005).exp() * 2.8673
        - 75.196;
    vec![f, -x * y + 700.0, x2 / 125.0 - y, -sq(y - 50.0) + (x - 55.0) * 5.0]
}

fn hs60<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        sq(x[0] - 1.0) + sq(x[0] - x[1]) + fourth(x[1] - x[2]),
        x[0] * (sq(x[1]) + 1.0) + fourth(x[2]) - 4.0 - 3.0 * 2.0_f64.sqrt(),
    ]
}
