//! Problems that are also used as min-max problems: objective and inequalities.

use mops_language::Scalar;

use crate::arithmetic::{cube, dot, fourth, sq, sum};

/// Rosen and Suzuki.
pub(crate) fn hs43<S: Scalar>(x: &[S]) -> Vec<S> {
    let s: Vec<S> = x.iter().map(|&x| sq(x)).collect();
    vec![
        dot(&[1.0, 1.0, 2.0, 1.0], &s) + dot(&[-5.0, -5.0, -21.0, 7.0], x),
        sum(s.clone()) + dot(&[1.0, -1.0, 1.0, -1.0], x) - 8.0,
        dot(&[1.0, 2.0, 1.0, 2.0], &s) + dot(&[-1.0, 0.0, 0.0, -1.0], x) - 10.0,
        dot(&[2.0, 1.0, 1.0], &s) + dot(&[2.0, -1.0, 0.0, -1.0], x) - 5.0,
    ]
}

/// Asaadi 2, also known as Wong 1.
pub(crate) fn hs100<S: Scalar>(x: &[S]) -> Vec<S> {
    let f = sq(x[0] - 10.0)
        + sq(x[1] - 12.0) * 5.0
        + fourth(x[2])
        + sq(x[3] - 11.0) * 3.0
        + sq(cube(x[4])) * 10.0
        + sq(x[5]) * 7.0
        + fourth(x[6])
        - x[5] * x[6] * 4.0
        - x[5] * 10.0
        - x[6] * 8.0;
    vec![
        f,
        sq(x[0]) * 2.0 + fourth(x[1]) * 3.0 + x[2] + sq(x[3]) * 4.0 + x[4] * 5.0 - 127.0,
        x[0] * 7.0 + x[1] * 3.0 + sq(x[2]) * 10.0 + x[3] - x[4] - 282.0,
        x[0] * 23.0 + sq(x[1]) + sq(x[5]) * 6.0 - x[6] * 8.0 - 196.0,
        sq(x[0]) * 4.0 + sq(x[1]) - x[0] * x[1] * 3.0 + sq(x[2]) * 2.0 + x[5] * 5.0 - x[6] * 11.0,
    ]
}

/// Objective of [`hs113`].
fn wong2<S: Scalar>(x: &[S]) -> S {
    sq(x[0]) + sq(x[1]) + x[0] * x[1] - x[0] * 14.0 - x[1] * 16.0
        + sq(x[2] - 10.0)
        + sq(x[3] - 5.0) * 4.0
        + sq(x[4] - 3.0)
        + sq(x[5] - 1.0) * 2.0
        + sq(x[6]) * 5.0
        + sq(x[7] - 11.0) * 7.0
        + sq(x[8] - 10.0) * 2.0
        + sq(x[9] - 7.0)
        + 45.0
}

/// Constraints of [`hs113`]: the nonlinear ones and the linear ones.
pub(crate) fn wong2_constraints<S: Scalar>(x: &[S]) -> [Vec<S>; 2] {
    let curved = vec![
        sq(x[0] - 2.0) * 3.0 + sq(x[1] - 3.0) * 4.0 + sq(x[2]) * 2.0 - x[3] * 7.0 - 120.0,
        sq(x[0]) * 5.0 + x[1] * 8.0 + sq(x[2] - 6.0) - x[3] * 2.0 - 40.0,
        sq(x[0] - 8.0) * 0.5 + sq(x[1] - 4.0) * 2.0 + sq(x[4]) * 3.0 - x[5] - 30.0,
        sq(x[0]) + sq(x[1] - 2.0) * 2.0 - x[0] * x[1] * 2.0 + x[4] * 14.0 - x[5] * 6.0,
        x[1] * 6.0 - x[0] * 3.0 + sq(x[8] - 8.0) * 12.0 - x[9] * 7.0,
    ];
    let linear = vec![
        x[0] * 4.0 + x[1] * 5.0 - x[6] * 3.0 + x[7] * 9.0 - 105.0,
        x[0] * 10.0 - x[1] * 8.0 - x[6] * 17.0 + x[7] * 2.0,
        x[1] * 2.0 - x[0] * 8.0 + x[8] * 5.0 - x[9] * 2.0 - 12.0,
    ];
    [curved, linear]
}

/// Asaadi 3, also known as Wong 2.
pub(crate) fn hs113<S: Scalar>(x: &[S]) -> Vec<S> {
    [vec![wong2(x)], wong2_constraints(x).concat()].concat()
}

/// Asaadi's problem in 20 variables, also known as Wong 3: the objective, and the nonlinear and linear constraints.
pub(crate) fn wong3<S: Scalar>(x: &[S]) -> (S, [Vec<S>; 2]) {
    let f = wong2(x)
        + sq(x[10] - 9.0)
        + sq(x[11] - 1.0) * 10.0
        + sq(x[12] - 7.0) * 5.0
        + sq(x[13] - 14.0) * 4.0
        + sq(x[14] - 1.0) * 27.0
        + fourth(x[15])
        + sq(x[16] - 2.0)
        + sq(x[17] - 2.0) * 13.0
        + sq(x[18] - 3.0)
        + sq(x[19])
        + 50.0;
    let [mut curved, mut linear] = wong2_constraints(x);
    linear.push(x[0] + x[1] + x[10] * 4.0 - x[11] * 21.0);
    curved.extend([
        sq(x[0]) + x[10] * 15.0 - x[11] * 8.0 - 28.0,
        x[0] * 4.0 + x[1] * 9.0 + sq(x[12]) * 5.0 - x[13] * 9.0 - 87.0,
        x[0] * 3.0 + x[1] * 4.0 + sq(x[12] - 6.0) * 3.0 - x[13] * 14.0 - 10.0,
        sq(x[0]) * 14.0 + x[14] * 35.0 - x[15] * 79.0 - 92.0,
        sq(x[1]) * 15.0 + x[14] * 11.0 - x[15] * 61.0 - 54.0,
        sq(x[0]) * 5.0 + x[1] * 2.0 + fourth(x[16]) * 9.0 - x[17] - 68.0,
        sq(x[0]) - x[1] + x[18] * 19.0 - x[19] * 20.0 + 19.0,
        sq(x[0]) * 7.0 + sq(x[1]) * 5.0 + sq(x[18]) - x[19] * 30.0,
    ]);
    (f, [curved, linear])
}
