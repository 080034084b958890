//! Problems 21 to 40: two to four variables.

use mops_language::Scalar;

use super::notation::{FREE, POSITIVE, hs, within};
use crate::arithmetic::{cube, dot, fourth, sq};
use crate::formula::Functions;
use crate::problem::Problem;

pub(super) fn problems() -> Vec<(u32, Problem)> {
    let box_to = |high: f64| [0.0, high];
    vec![
        within(&[[2.0, 50.0], [-50.0, 50.0]], hs(21, &[-1.0, -1.0], [1, 0], -99.96, Functions::of(hs21, hs21))),
        hs(22, &[2.0, 2.0], [2, 0], 1.0, Functions::of(hs22, hs22)),
        within(&[[-50.0, 50.0]; 2], hs(23, &[3.0, 1.0], [5, 0], 2.0, Functions::of(hs23, hs23))),
        within(&[POSITIVE; 2], hs(24, &[1.0, 0.5], [3, 0], -1.0, Functions::of(hs24, hs24))),
        hs(26, &[-2.6, 2.0, 2.0], [0, 1], 0.0, Functions::of(hs26, hs26)),
        hs(27, &[2.0; 3], [0, 1], 0.04, Functions::of(hs27, hs27)),
        hs(28, &[-4.0, 1.0, 1.0], [0, 1], 0.0, Functions::of(hs28, hs28)),
        hs(29, &[1.0; 3], [1, 0], -16.0 * 2.0_f64.sqrt(), Functions::of(hs29, hs29)),
        within(&[[1.0, 10.0], [-10.0, 10.0], [-10.0, 10.0]], hs(30, &[1.0; 3], [1, 0], 1.0, Functions::of(hs30, hs30))),
        within(&[[-10.0, 10.0], [1.0, 10.0], [-10.0, 1.0]], hs(31, &[1.0; 3], [1, 0], 6.0, Functions::of(hs31, hs31))),
        within(&[POSITIVE; 3], hs(32, &[0.1, 0.7, 0.2], [1, 1], 1.0, Functions::of(hs32, hs32))),
        within(
            &[POSITIVE, POSITIVE, box_to(5.0)],
            hs(33, &[0.0, 0.0, 3.0], [2, 0], [2.0_f64.sqrt() - 6.0, -4.0], Functions::of(hs33, hs33)),
        ),
        within(
            &[box_to(100.0), box_to(100.0), box_to(10.0)],
            hs(34, &[0.0, 1.05, 2.9], [2, 0], -0.8340324452, Functions::of(hs34, hs34)),
        ),
        within(&[POSITIVE; 3], hs(35, &[0.5; 3], [1, 0], 1.0 / 9.0, Functions::of(hs35, hs35))),
        within(
            &[box_to(20.0), box_to(11.0), box_to(42.0)],
            hs(36, &[10.0; 3], [1, 0], -3300.0, Functions::of(hs36, hs36)),
        ),
        within(&[box_to(42.0); 3], hs(37, &[10.0; 3], [2, 0], -3456.0, Functions::of(hs37, hs37))),
        within(&[[-10.0, 10.0]; 4], hs(38, &[-3.0, -1.0, -3.0, -1.0], [0, 0], 0.0, Functions::of(hs38, hs38))),
        hs(39, &[2.0; 4], [0, 2], -1.0, Functions::of(hs39, hs39)),
        within(&[FREE; 4], hs(40, &[0.8; 4], [0, 3], -0.25, Functions::of(hs40, hs40))),
    ]
}

fn hs21<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0]) * 0.01 + sq(x[1]) - 100.0, -x[0] * 10.0 + x[1] + 10.0]
}

fn hs22<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0] - 2.0) + sq(x[1] - 1.0), x[0] + x[1] - 2.0, sq(x[0]) - x[1]]
}

fn hs23<S: Scalar>(x: &[S]) -> Vec<S> {
    let (a, b) = (sq(x[0]), sq(x[1]));
    vec![a + b, -x[0] - x[1] + 1.0, -a - b + 1.0, -a * 9.0 - b + 9.0, x[1] - a, x[0] - b]
}

fn hs24<S: Scalar>(x: &[S]) -> Vec<S> {
    let root = 3.0_f64.sqrt();
    vec![
        (sq(x[0] - 3.0) - 9.0) * cube(x[1]) / (27.0 * root),
        x[1] - x[0] / root,
        -x[0] - x[1] * root,
        x[0] + x[1] * root - 6.0,
    ]
}

fn hs26<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0] - x[1]) + fourth(x[1] - x[2]), (sq(x[1]) + 1.0) * x[0] + fourth(x[2]) - 3.0]
}

fn hs27<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0] - 1.0) * 0.01 + sq(x[1] - sq(x[0])), x[0] + sq(x[2]) + 1.0]
}

fn hs28<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0] + x[1]) + sq(x[1] + x[2]), dot(&[1.0, 2.0, 3.0], x) - 1.0]
}

fn hs29<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![-x[0] * x[1] * x[2], sq(x[0]) + sq(x[1]) * 2.0 + sq(x[2]) * 4.0 - 48.0]
}

fn hs30<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0]) + sq(x[1]) + sq(x[2]), -sq(x[0]) - sq(x[1]) + 1.0]
}

fn hs31<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0]) * 9.0 + sq(x[1]) + sq(x[2]) * 9.0, -x[0] * x[1] + 1.0]
}

fn hs32<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        sq(dot(&[1.0, 3.0, 1.0], x)) + sq(x[0] - x[1]) * 4.0,
        cube(x[0]) - x[1] * 6.0 - x[2] * 4.0 + 3.0,
        -x[0] - x[1] - x[2] + 1.0,
    ]
}

fn hs33<S: Scalar>(x: &[S]) -> Vec<S> {
    let s = sq(x[0]) + sq(x[1]);
    vec![(x[0] - 1.0) * (x[0] - 2.0) * (x[0] - 3.0) + x[2], s - sq(x[2]), -s - sq(x[2]) + 4.0]
}

fn hs34<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![-x[0], x[0].exp() - x[1], x[1].exp() - x[2]]
}

fn hs35<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        dot(&[-8.0, -6.0, -4.0], x) + sq(x[0]) * 2.0 + sq(x[1]) * 2.0 + sq(x[2]) + x[0] * (x[1] + x[2]) * 2.0 + 9.0,
        dot(&[1.0, 1.0, 2.0], x) - 3.0,
    ]
}

fn hs36<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![-x[0] * x[1] * x[2], dot(&[1.0, 2.0, 2.0], x) - 72.0]
}

fn hs37<S: Scalar>(x: &[S]) -> Vec<S> {
    let width = dot(&[1.0, 2.0, 2.0], x);
    vec![-x[0] * x[1] * x[2], width - 72.0, -width]
}

fn hs38<S: Scalar>(x: &[S]) -> Vec<S> {
    let (b, d) = (x[1] - 1.0, x[3] - 1.0);
    let first = sq(x[1] - sq(x[0])) * 100.0 + sq(-x[0] + 1.0);
    let second = sq(x[3] - sq(x[2])) * 90.0 + sq(-x[2] + 1.0);
    vec![first + second + (sq(b) + sq(d)) * 10.1 + b * d * 19.8]
}

fn hs39<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![-x[0], x[1] - cube(x[0]) - sq(x[2]), sq(x[0]) - x[1] - sq(x[3])]
}

fn hs40<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![-x[0] * x[1] * x[2] * x[3], cube(x[0]) + sq(x[1]) - 1.0, sq(x[0]) * x[3] - x[2], sq(x[3]) - x[1]]
}
