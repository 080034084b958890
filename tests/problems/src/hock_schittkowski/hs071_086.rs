//! Problems 71 to 86: four and five variables.

use mops_language::Scalar;

use super::notation::{FREE, POSITIVE, hs, within};
use crate::arithmetic::{c, cube, dot, fourth, sq, sum};
use crate::formula::Functions;
use crate::problem::Problem;

pub(super) fn problems() -> Vec<(u32, Problem)> {
    let network = |a: f64| [[0.0, 1200.0], [0.0, 1200.0], [-a, a], [-a, a]];
    let five = [[-2.3, 2.3], [-2.3, 2.3], [-3.2, 3.2], [-3.2, 3.2], [-3.2, 3.2]];
    let swing = [-2.0, 2.0, 2.0, -1.0, -1.0];
    vec![
        within(&[[1.0, 5.0]; 4], hs(71, &[1.0, 5.0, 5.0, 1.0], [1, 1], 17.01401729, Functions::of(hs71, hs71))),
        within(
            &[4.0, 3.0, 2.0, 1.0].map(|high| [0.001, 1e5 * high]),
            hs(72, &[1.0; 4], [2, 0], 727.67937, Functions::of(hs72, hs72)),
        ),
        within(&[POSITIVE; 4], hs(73, &[1.0; 4], [2, 1], 29.89437816, Functions::of(hs73, hs73))),
        within(&network(0.55), hs(74, &[0.0; 4], [2, 3], 5126.49811, Functions::of(hs74, hs74))),
        within(&network(0.48), hs(75, &[0.0; 4], [2, 3], 5174.41267, Functions::of(hs75, hs75))),
        within(&[POSITIVE; 4], hs(76, &[0.5; 4], [3, 0], -4.68181818, Functions::of(hs76, hs76))),
        hs(77, &[2.0; 5], [0, 2], 0.2415051288, Functions::of(hs77, hs77)),
        within(&[FREE; 5], hs(78, &[-2.0, 1.5, 2.0, -1.0, -1.0], [0, 3], -2.919700409, Functions::of(hs78, hs78))),
        hs(79, &[2.0; 5], [0, 3], 0.07877682087, Functions::of(hs79, hs79)),
        within(&five, hs(80, &swing, [0, 3], 0.05394984777, Functions::of(hs80, hs80))),
        within(&five, hs(81, &swing, [0, 3], 0.05394984777, Functions::of(hs81, hs81))),
        within(
            &[[78.0, 102.0], [33.0, 45.0], [27.0, 45.0], [27.0, 45.0], [27.0, 45.0]],
            hs(83, &[78.0, 33.0, 27.0, 27.0, 27.0], [6, 0], -30665.53867, Functions::of(hs83, hs83)),
        ),
        within(
            &[[0.0, 1000.0], [1.2, 2.4], [20.0, 60.0], [9.0, 9.3], [6.5, 7.0]],
            hs(84, &[2.52, 2.0, 37.5, 9.25, 6.8], [6, 0], -5280335.133, Functions::of(hs84, hs84)),
        ),
        within(&[POSITIVE; 5], hs(86, &[0.0, 0.0, 0.0, 0.0, 1.0], [10, 0], -32.34867897, Functions::of(hs86, hs86))),
    ]
}

fn hs71<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2],
        -x[0] * x[1] * x[2] * x[3] + 25.0,
        sum(x.iter().map(|&x| sq(x))) - 40.0,
    ]
}

fn hs72<S: Scalar>(x: &[S]) -> Vec<S> {
    let over = [x[0], x[1], x[2], x[3]].map(|x| c::<S>(1.0) / x);
    vec![
        sum(x.iter().copied()) + 1.0,
        dot(&[4.0, 2.25, 1.0, 0.25], &over) - 0.0401,
        dot(&[0.16, 0.36, 0.64, 0.64], &over) - 0.010085,
    ]
}

fn hs73<S: Scalar>(x: &[S]) -> Vec<S> {
    let variance = sum([0.28, 0.19, 20.5, 0.62].iter().zip(x).map(|(&v, &x)| sq(x) * v));
    vec![
        dot(&[24.55, 26.75, 39.0, 40.5], x),
        -dot(&[2.3, 5.6, 11.1, 1.3], x) + 5.0,
        variance.sqrt() * 1.645 - dot(&[12.0, 11.9, 41.8, 52.1], x) + 21.0,
        sum(x.iter().copied()) - 1.0,
    ]
}

fn network<S: Scalar>(x: &[S], a: f64) -> Vec<S> {
    let flow = |angle: S| (angle - 0.25).sin() * 1000.0;
    vec![
        x[0] * 3.0 + cube(x[0]) * 1e-6 + x[1] * 2.0 + cube(x[1]) * (2e-6 / 3.0),
        x[2] - x[3] - a,
        x[3] - x[2] - a,
        flow(-x[2]) + flow(-x[3]) + 894.8 - x[0],
        flow(x[2]) + flow(x[2] - x[3]) + 894.8 - x[1],
        flow(x[3]) + flow(x[3] - x[2]) + 1294.8,
    ]
}

fn hs74<S: Scalar>(x: &[S]) -> Vec<S> {
    network(x, 0.55)
}

fn hs75<S: Scalar>(x: &[S]) -> Vec<S> {
    network(x, 0.48)
}

fn hs76<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        sq(x[0]) + sq(x[1]) * 0.5 + sq(x[2]) + sq(x[3]) * 0.5 - x[0] * x[2]
            + x[2] * x[3]
            + dot(&[-1.0, -3.0, 1.0, -1.0], x),
        dot(&[1.0, 2.0, 1.0, 1.0], x) - 5.0,
        dot(&[3.0, 1.0, 2.0, -1.0], x) - 4.0,
        -x[1] - x[2] * 4.0 + 1.5,
    ]
}

fn hs77<S: Scalar>(x: &[S]) -> Vec<S> {
    let root = 2.0_f64.sqrt();
    vec![
        sq(x[0] - 1.0) + sq(x[0] - x[1]) + sq(x[2] - 1.0) + fourth(x[3] - 1.0) + sq(cube(x[4] - 1.0)),
        sq(x[0]) * x[3] + (x[3] - x[4]).sin() - 2.0 * root,
        x[1] + fourth(x[2]) * sq(x[3]) - 8.0 - root,
    ]
}

fn product<S: Scalar>(x: &[S]) -> S {
    x.iter().skip(1).fold(x[0], |product, &x| product * x)
}

fn sphere<S: Scalar>(x: &[S]) -> [S; 3] {
    [sum(x.iter().map(|&x| sq(x))) - 10.0, x[1] * x[2] - x[3] * x[4] * 5.0, cube(x[0]) + cube(x[1]) + 1.0]
}

fn hs78<S: Scalar>(x: &[S]) -> Vec<S> {
    [vec![product(x)], sphere(x).to_vec()].concat()
}

fn hs79<S: Scalar>(x: &[S]) -> Vec<S> {
    let root = 2.0_f64.sqrt();
    vec![
        sq(x[0] - 1.0) + sq(x[0] - x[1]) + sq(x[1] - x[2]) + fourth(x[2] - x[3]) + fourth(x[3] - x[4]),
        x[0] + sq(x[1]) + cube(x[2]) - 2.0 - 3.0 * root,
        x[1] - sq(x[2]) + x[3] + 2.0 - 2.0 * root,
        x[0] * x[4] - 2.0,
    ]
}

fn hs80<S: Scalar>(x: &[S]) -> Vec<S> {
    [vec![product(x).exp()], sphere(x).to_vec()].concat()
}

fn hs81<S: Scalar>(x: &[S]) -> Vec<S> {
    let constraints = sphere(x);
    [vec![product(x).exp() - sq(constraints[2]) * 0.5], constraints.to_vec()].concat()
}

/// Both sides of `low <= y <= high`.
fn between<S: Scalar>(y: S, low: f64, high: f64) -> [S; 2] {
    [-y + low, y - high]
}

fn hs83<S: Scalar>(x: &[S]) -> Vec<S> {
    let first = x[1] * x[4] * 0.0056858 + x[0] * x[3] * 0.0006262 - x[2] * x[4] * 0.0022053 + 85.334407;
    let second = x[1] * x[4] * 0.0071317 + x[0] * x[1] * 0.0029955 + sq(x[2]) * 0.0021813 + 80.51249;
    let third = x[2] * x[4] * 0.0047026 + x[0] * x[2] * 0.0012547 + x[2] * x[3] * 0.0019085 + 9.300961;
    let mut rows = vec![sq(x[2]) * 5.3578547 + x[0] * x[4] * 0.8356891 + x[0] * 37.293239 - 40792.141];
    rows.extend([between(first, 0.0, 92.0), between(second, 90.0, 110.0), between(third, 20.0, 25.0)].concat());
    rows
}

fn hs84<S: Scalar>(x: &[S]) -> Vec<S> {
    const A: [[f64; 5]; 4] = [
        [-8720288.849, 150512.5253, -156.6950325, 476470.3222, 729482.8271],
        [-145421.402, 2931.1506, -40.427932, 5106.192, 15711.36],
        [-155011.1084, 4360.53352, 12.9492344, 10236.884, 13176.786],
        [-326669.5104, 7390.68412, -27.8986976, 16643.076, 30988.146],
    ];
    let y = A.map(|a| x[0] * (dot(&a[1..], &x[1..]) + a[0]));
    let mut rows = vec![-y[0] + 24345.0];
    rows.extend([between(y[1], 0.0, 294e3), between(y[2], 0.0, 294e3), between(y[3], 0.0, 277200.0)].concat());
    rows
}

/// Data of the first and second of Colville's problems.
pub(super) mod colville {
    pub const E: [f64; 5] = [-15.0, -27.0, -36.0, -18.0, -12.0];
    pub const C: [[f64; 5]; 5] = [
        [30.0, -20.0, -10.0, 32.0, -10.0],
        [-20.0, 39.0, -6.0, -31.0, 32.0],
        [-10.0, -6.0, 10.0, -6.0, -10.0],
        [32.0, -31.0, -6.0, 39.0, -20.0],
        [-10.0, 32.0, -10.0, -20.0, 30.0],
    ];
    pub const D: [f64; 5] = [4.0, 8.0, 10.0, 6.0, 2.0];
    pub const A: [[f64; 5]; 10] = [
        [-16.0, 2.0, 0.0, 1.0, 0.0],
        [0.0, -2.0, 0.0, 0.4, 2.0],
        [-3.5, 0.0, 2.0, 0.0, 0.0],
        [0.0, -2.0, 0.0, -4.0, -1.0],
        [0.0, -9.0, -2.0, 1.0, -2.8],
        [2.0, 0.0, -4.0, 0.0, 0.0],
        [-1.0, -1.0, -1.0, -1.0, -1.0],
        [-1.0, -2.0, -3.0, -2.0, -1.0],
        [1.0, 2.0, 3.0, 4.0, 5.0],
        [1.0, 1.0, 1.0, 1.0, 1.0],
    ];
    pub const B: [f64; 10] = [-40.0, -2.0, -0.25, -4.0, -4.0, -1.0, -40.0, -60.0, 5.0, 1.0];
}

fn hs86<S: Scalar>(x: &[S]) -> Vec<S> {
    let quadratic = sum(colville::C.iter().zip(x).map(|(row, &x_i)| x_i * dot(row, x)));
    let cubic = sum(colville::D.iter().zip(x).map(|(&d, &x)| cube(x) * d));
    let mut rows = vec![dot(&colville::E, x) + quadratic + cubic];
    rows.extend(colville::A.iter().zip(colville::B).map(|(a, b)| -dot(a, x) + b));
    rows
}
