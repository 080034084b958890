//! `constrained-fronts`: two objectives with constraints.

use mops_language::Scalar;
use mops_math as math;

use super::definition::{best_of, evenly, problem, sampled};
use crate::arithmetic::atan;
use crate::{Problem, Suite};

pub(crate) const SUITE: Suite = Suite {
    name: "constrained-fronts",
    about: "BNH, SRN, TNK and OSY: two objectives with inequalities",
    source: "K. Deb, Multi-Objective Optimization Using Evolutionary Algorithms (2001), section 8.3",
    accuracy: 0.02,
    budget: |_| 30_000,
    problems: || {
        let osy_box = vec![[0.0, 10.0], [0.0, 10.0], [1.0, 5.0], [0.0, 6.0], [1.0, 5.0], [0.0, 10.0]];
        let with = |problem: Problem, inequalities: usize| Problem { inequalities, ..problem };
        let pi = std::f64::consts::PI;
        vec![
            with(
                problem("BNH", vec![[0.0, 5.0], [0.0, 3.0]], (bnh, bnh), sampled(&[140.0, 50.0], 20_000, bnh_front)),
                2,
            ),
            with(problem("SRN", vec![[-20.0, 20.0]; 2], (srn, srn), sampled(&[250.0, 10.0], 20_000, srn_front)), 2),
            with(problem("TNK", vec![[1e-9, pi]; 2], (tnk, tnk), sampled(&[1.1, 1.1], 20_000, tnk_front)), 2),
            with(problem("OSY", osy_box, (osy, osy), sampled(&[-40.0, 80.0], 20_000, osy_front)), 6),
        ]
    },
};

/// Two objectives, then the constraints, satisfied if at most 0.
fn bnh<S: Scalar>(x: &[S]) -> Vec<S> {
    let square = |a: S, at: f64| (a - at) * (a - at);
    vec![
        (x[0] * x[0] + x[1] * x[1]) * 4.0,
        square(x[0], 5.0) + square(x[1], 5.0),
        (square(x[0], 5.0) + x[1] * x[1]) / 25.0 - 1.0,
        -(square(x[0], 8.0) + square(x[1], -3.0)) / 7.7 + 1.0,
    ]
}

fn bnh_front(count: usize) -> Vec<Vec<f64>> {
    let values = |t: f64| bnh(&[t, t.min(3.0)])[..2].to_vec();
    evenly(0.0, 5.0, count).map(values).collect()
}

fn srn<S: Scalar>(x: &[S]) -> Vec<S> {
    let square = |a: S, at: f64| (a - at) * (a - at);
    vec![
        square(x[0], 2.0) + square(x[1], 1.0) + 2.0,
        x[0] * 9.0 - square(x[1], 1.0),
        (x[0] * x[0] + x[1] * x[1]) / 225.0 - 1.0,
        (x[0] - x[1] * 3.0) / 10.0 + 1.0,
    ]
}

/// Front in two parts. The first follows the boundary of the second constraint from the minimum of the first objective,
/// `x_1 = -5/2`; the second follows the circle to the minimum of the second objective.
fn srn_front(count: usize) -> Vec<Vec<f64>> {
    let top = (225.0_f64 - 6.25).sqrt();
    let pieces =
        evenly(2.5, 3.7, count).map(|y| [3.0 * y - 10.0, y]).chain(evenly(2.5, top, count).map(|y| [-2.5, y])).chain(
            evenly(math::asin(2.5_f64 / 15.0), 0.5, count)
                .map(|angle| [-15.0 * math::sin(angle), 15.0 * math::cos(angle)]),
        );
    best_of(&pieces.map(|x| srn(&x)[..2].to_vec()).collect::<Vec<_>>())
}

fn tnk<S: Scalar>(x: &[S]) -> Vec<S> {
    let (a, b) = (x[0] - 0.5, x[1] - 0.5);
    let wave = (atan(x[0] / x[1]) * 16.0).cos() * 0.1;
    vec![x[0], x[1], -x[0] * x[0] - x[1] * x[1] + 1.0 + wave, (a * a + b * b) * 2.0 - 1.0]
}

/// Part of the boundary of the first constraint that the second permits and that is non-dominated.
fn tnk_front(count: usize) -> Vec<Vec<f64>> {
    let edge = |angle: f64| {
        let radius = (1.0 + 0.1 * math::cos(16.0 * angle)).sqrt();
        vec![radius * math::sin(angle), radius * math::cos(angle)]
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    let allowed = |p: &Vec<f64>| math::powi(p[0] - 0.5, 2) + math::powi(p[1] - 0.5, 2) <= 0.5;
    best_of(&evenly(1e-9, quarter - 1e-9, 3 * count).map(edge).filter(allowed).collect::<Vec<_>>())
}

fn osy<S: Scalar>(x: &[S]) -> Vec<S> {
    let square = |a: S, at: f64| (a - at) * (a - at);
    let first =
        square(x[0], 2.0) * 25.0 + square(x[1], 2.0) + square(x[2], 1.0) + square(x[3], 4.0) + square(x[4], 1.0);
    vec![
        -first,
        x.iter().fold(S::from(0.0), |sum, x| sum + *x * *x),
        -(x[0] + x[1]) / 2.0 + 1.0,
        (x[0] + x[1]) / 6.0 - 1.0,
        (x[1] - x[0]) / 2.0 - 1.0,
        (x[0] - x[1] * 3.0) / 2.0 - 1.0,
        (square(x[2], 3.0) + x[3]) / 4.0 - 1.0,
        -(square(x[4], 3.0) + x[5]) / 4.0 + 1.0,
    ]
}

/// Five segments with `x_4 = x_6 = 0`, without dominated points.
fn osy_front(count: usize) -> Vec<Vec<f64>> {
    let root = 3.0_f64.sqrt();
    let values = |x: [f64; 5]| osy(&[x[0], x[1], x[2], 0.0, x[4], 0.0])[..2].to_vec();
    let pieces = evenly(1.0, 5.0, count)
        .map(|t| [5.0, 1.0, t, 0.0, 5.0])
        .chain(evenly(1.0, 5.0, count).map(|t| [5.0, 1.0, t, 0.0, 1.0]))
        .chain(evenly(4.0, 5.0, count).map(|t| [t, (t - 2.0) / 3.0, 1.0, 0.0, 1.0]))
        .chain(evenly(1.0, 2.0 + root, count).map(|t| [0.0, 2.0, t, 0.0, 1.0]))
        .chain(evenly(0.0, 1.0, count).map(|t| [t, 2.0 - t, 1.0, 0.0, 1.0]));
    best_of(&pieces.map(values).collect::<Vec<_>>())
}
