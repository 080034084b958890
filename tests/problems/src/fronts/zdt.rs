//! `zdt`: two conflicting objectives.

use std::f64::consts::PI;

use mops_language::Scalar;
use mops_math as math;

use super::definition::{Points, best_of, evenly, known, problem, sampled};
use crate::Suite;

pub(crate) const SUITE: Suite = Suite {
    name: "zdt",
    about: "the five problems of Zitzler, Deb and Thiele in real variables, with two objectives",
    source: "E. Zitzler, K. Deb, L. Thiele, Evolutionary Computation 8 (2000) 173-195",
    accuracy: 0.01,
    budget: |_| 30_000,
    problems: || {
        let unit = |n: usize| vec![[0.0, 1.0]; n];
        let mut wide = vec![[-5.0, 5.0]; 10];
        wide[0] = [0.0, 1.0];
        // With f_2 = 1 - sqrt(f_1), and 1 - f_1^2: the integral of 1.1 - f_2 over [a, 1], and the strip beyond 1.
        let root = || known(&REFERENCE, 0.1 + 2.0 / 3.0 + 0.11, convex);
        let square =
            |a: f64, points: Points| known(&REFERENCE, 0.1 * (1.0 - a) + (1.0 - math::powi(a, 3)) / 3.0 + 0.11, points);
        vec![
            problem("ZDT1", unit(30), (zdt1, zdt1), root()),
            problem("ZDT2", unit(30), (zdt2, zdt2), square(0.0, concave)),
            problem("ZDT3", unit(30), (zdt3, zdt3), sampled(&REFERENCE, 20_000, disconnected)),
            problem("ZDT4", wide, (zdt4, zdt4), root()),
            problem("ZDT6", unit(10), (zdt6, zdt6), square(LEAST_F1, biased)),
        ]
    },
};

const REFERENCE: [f64; 2] = [1.1, 1.1];

/// Minimum of `1 - exp(-4 x) sin(6 pi x)^6`.
const LEAST_F1: f64 = 0.280_775_318_806_163_1;

#[allow(clippy::cast_precision_loss)]
fn mean<S: Scalar>(x: &[S]) -> S {
    x.iter().fold(S::from(0.0), |sum, x| sum + *x) / x.len() as f64
}

fn zdt1<S: Scalar>(x: &[S]) -> Vec<S> {
    let g = mean(&x[1..]) * 9.0 + 1.0;
    vec![x[0], g - (x[0] * g).sqrt()]
}

fn zdt2<S: Scalar>(x: &[S]) -> Vec<S> {
    let g = mean(&x[1..]) * 9.0 + 1.0;
    vec![x[0], g - x[0] * x[0] / g]
}

fn zdt3<S: Scalar>(x: &[S]) -> Vec<S> {
    let g = mean(&x[1..]) * 9.0 + 1.0;
    vec![x[0], g - (x[0] * g).sqrt() - x[0] * (x[0] * (10.0 * PI)).sin()]
}

#[allow(clippy::cast_precision_loss)]
fn zdt4<S: Scalar>(x: &[S]) -> Vec<S> {
    let bumps = x[1..].iter().fold(S::from(0.0), |sum, x| sum + *x * *x - (*x * (4.0 * PI)).cos() * 10.0);
    let g = bumps + 1.0 + 10.0 * (x.len() - 1) as f64;
    vec![x[0], g - (x[0] * g).sqrt()]
}

fn zdt6<S: Scalar>(x: &[S]) -> Vec<S> {
    let sine = (x[0] * (6.0 * PI)).sin();
    let f = -(x[0] * -4.0).exp() * (sine * sine * sine) * (sine * sine * sine) + 1.0;
    let g = mean(&x[1..]).powf(0.25) * 9.0 + 1.0;
    vec![f, g - f * f / g]
}

fn convex(count: usize) -> Vec<Vec<f64>> {
    evenly(0.0, 1.0, count).map(|f| vec![f, 1.0 - f.sqrt()]).collect()
}

fn concave(count: usize) -> Vec<Vec<f64>> {
    evenly(0.0, 1.0, count).map(|f| vec![f, 1.0 - f * f]).collect()
}

fn biased(count: usize) -> Vec<Vec<f64>> {
    evenly(LEAST_F1, 1.0, count).map(|f| vec![f, 1.0 - f * f]).collect()
}

/// Returns the non-dominated points of the curve, about a third.
fn disconnected(count: usize) -> Vec<Vec<f64>> {
    let curve = |f: f64| vec![f, 1.0 - f.sqrt() - f * math::sin(10.0 * PI * f)];
    best_of(&evenly(0.0, 0.852, 3 * count).map(curve).collect::<Vec<_>>())
}
