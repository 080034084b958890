//! Problems 1 to 20: two variables.

use mops_language::Scalar;

use super::notation::{FREE, POSITIVE, hs, within};
use crate::arithmetic::{c, cube, sq};
use crate::formula::Functions;
use crate::problem::Problem;

pub(super) fn problems() -> Vec<(u32, Problem)> {
    let up = f64::INFINITY;
    let down = f64::NEG_INFINITY;
    vec![
        within(&[FREE, [-1.5, up]], hs(1, &[-2.0, 1.0], [0, 0], 0.0, Functions::of(rosenbrock, rosenbrock))),
        within(
            &[FREE, [1.5, up]],
            hs(2, &[-2.0, 1.0], [0, 0], [0.0504261879, 4.941229318], Functions::of(rosenbrock, rosenbrock)),
        ),
        within(&[FREE, POSITIVE], hs(3, &[10.0, 1.0], [0, 0], 0.0, Functions::of(hs3, hs3))),
        within(&[[1.0, up], POSITIVE], hs(4, &[1.125, 0.125], [0, 0], 8.0 / 3.0, Functions::of(hs4, hs4))),
        within(&[[-1.5, 4.0], [-3.0, 3.0]], hs(5, &[0.0, 0.0], [0, 0], -1.913222955, Functions::of(hs5, hs5))),
        hs(6, &[-1.2, 1.0], [0, 1], 0.0, Functions::of(hs6, hs6)),
        hs(7, &[2.0, 2.0], [0, 1], -3.0_f64.sqrt(), Functions::of(hs7, hs7)),
        hs(8, &[2.0, 1.0], [0, 2], -1.0, Functions::of(hs8, hs8)),
        hs(9, &[0.0, 0.0], [0, 1], -0.5, Functions::of(hs9, hs9)),
        hs(10, &[-10.0, 10.0], [1, 0], -1.0, Functions::of(hs10, hs10)),
        hs(11, &[4.9, 0.1], [1, 0], -8.498464223, Functions::of(hs11, hs11)),
        hs(12, &[0.0, 0.0], [1, 0], -30.0, Functions::of(hs12, hs12)),
        // No constraint qualification holds at the solution.
        within(&[POSITIVE; 2], hs(13, &[-2.0, -2.0], [1, 0], 1.0, Functions::of(hs13, hs13))),
        hs(14, &[2.0, 2.0], [1, 1], 9.0 - 2.875 * 7.0_f64.sqrt(), Functions::of(hs14, hs14)),
        within(&[[down, 0.5], FREE], hs(15, &[-2.0, 1.0], [2, 0], [306.5, 360.3797673], Functions::of(hs15, hs15))),
        within(
            &[[-2.0, 0.5], [down, 1.0]],
            hs(16, &[-2.0, 1.0], [2, 0], [0.25, 3.982060454, 23.14466], Functions::of(hs16, hs16)),
        ),
        within(&[[-0.5, 0.5], [down, 1.0]], hs(17, &[-2.0, 1.0], [2, 0], 1.0, Functions::of(hs17, hs17))),
        within(&[[2.0, 50.0], [0.0, 50.0]], hs(18, &[2.0, 2.0], [2, 0], 5.0, Functions::of(hs18, hs18))),
        within(&[[13.0, 100.0], [0.0, 100.0]], hs(19, &[20.1, 5.84], [2, 0], -6961.813876, Functions::of(hs19, hs19))),
        within(
            &[[-0.5, 0.5], FREE],
            hs(20, &[-2.0, 1.0], [3, 0], [81.5 - 25.0 * 3.0_f64.sqrt(), 40.19872981], Functions::of(hs20, hs20)),
        ),
    ]
}

fn rosen<S: Scalar>(x: &[S]) -> S {
    sq(x[1] - sq(x[0])) * 100.0 + sq(-x[0] + 1.0)
}

fn rosenbrock<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![rosen(x)]
}

fn hs3<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![x[1] + sq(x[1] - x[0]) * 1e-5]
}

fn hs4<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![cube(x[0] + 1.0) / 3.0 + x[1]]
}

fn hs5<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![(x[0] + x[1]).sin() + sq(x[0] - x[1]) - x[0] * 1.5 + x[1] * 2.5 + 1.0]
}

fn hs6<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(-x[0] + 1.0), (x[1] - sq(x[0])) * 10.0]
}

fn hs7<S: Scalar>(x: &[S]) -> Vec<S> {
    let s = sq(x[0]) + 1.0;
    vec![s.ln() - x[1], sq(s) + sq(x[1]) - 4.0]
}

fn hs8<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![c(-1.0), sq(x[0]) + sq(x[1]) - 25.0, x[0] * x[1] - 9.0]
}

fn hs9<S: Scalar>(x: &[S]) -> Vec<S> {
    let pi = std::f64::consts::PI;
    vec![(x[0] * (pi / 12.0)).sin() * (x[1] * (pi / 16.0)).cos(), x[0] * 4.0 - x[1] * 3.0]
}

fn hs10<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![x[0] - x[1], sq(x[0]) * 3.0 - x[0] * x[1] * 2.0 + sq(x[1]) - 1.0]
}

fn hs11<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0] - 5.0) + sq(x[1]) - 25.0, sq(x[0]) - x[1]]
}

fn hs12<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0]) * 0.5 + sq(x[1]) - x[0] * x[1] - x[0] * 7.0 - x[1] * 7.0, sq(x[0]) * 4.0 + sq(x[1]) - 25.0]
}

fn hs13<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0] - 2.0) + sq(x[1]), x[1] - cube(-x[0] + 1.0)]
}

fn hs14<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0] - 2.0) + sq(x[1] - 1.0), sq(x[0]) * 0.25 + sq(x[1]) - 1.0, x[0] - x[1] * 2.0 + 1.0]
}

fn hs15<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![rosen(x), -x[0] * x[1] + 1.0, -x[0] - sq(x[1])]
}

fn hs16<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![rosen(x), -x[0] - sq(x[1]), -sq(x[0]) - x[1]]
}

fn hs17<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![rosen(x), x[0] - sq(x[1]), x[1] - sq(x[0])]
}

fn hs18<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0]) * 0.01 + sq(x[1]), -x[0] * x[1] + 25.0, -sq(x[0]) - sq(x[1]) + 25.0]
}

fn hs19<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        cube(x[0] - 10.0) + cube(x[1] - 20.0),
        -sq(x[0] - 5.0) - sq(x[1] - 5.0) + 100.0,
        sq(x[1] - 5.0) + sq(x[0] - 6.0) - 82.81,
    ]
}

fn hs20<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![rosen(x), -x[0] - sq(x[1]), -sq(x[0]) - x[1], -sq(x[0]) - sq(x[1]) + 1.0]
}
