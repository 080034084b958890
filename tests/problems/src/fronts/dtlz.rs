//! `dtlz`: three objectives; the front is a plane, a sphere, a curve or disconnected.

use std::f64::consts::{FRAC_PI_2, PI};

use mops_language::Scalar;
use mops_math as math;

use super::definition::{best_of, evenly, known, problem, sampled};
use crate::Suite;

pub(crate) const SUITE: Suite = Suite {
    name: "dtlz",
    about: "the seven problems of Deb, Thiele, Laumanns and Zitzler, with three objectives",
    source: "K. Deb, L. Thiele, M. Laumanns, E. Zitzler, Scalable test problems for evolutionary multiobjective \
             optimization (2005), sections 6.7.1 to 6.7.7",
    accuracy: 0.05,
    budget: |_| 40_000,
    problems: || {
        let unit = |n: usize| vec![[0.0, 1.0]; n];
        // Volume of the box minus the volume below the plane, or inside the sphere.
        let plane = known(&[0.55; 3], math::powi(0.55, 3) - math::powi(0.5, 3) / 6.0, plane_front);
        let sphere = || known(&[1.1; 3], math::powi(1.1, 3) - PI / 6.0, sphere_front);
        let curve = || sampled(&[1.1; 3], 20_000, curve_front);
        vec![
            problem("DTLZ1", unit(7), (dtlz1, dtlz1), plane),
            problem("DTLZ2", unit(12), (dtlz2, dtlz2), sphere()),
            problem("DTLZ3", unit(12), (dtlz3, dtlz3), sphere()),
            problem("DTLZ4", unit(12), (dtlz4, dtlz4), sphere()),
            problem("DTLZ5", unit(12), (dtlz5, dtlz5), curve()),
            problem("DTLZ6", unit(12), (dtlz6, dtlz6), curve()),
            problem("DTLZ7", unit(22), (dtlz7, dtlz7), sampled(&[1.0, 1.0, 6.5], 10_000, pieces_front)),
        ]
    },
};

fn sum<S: Scalar>(terms: impl Iterator<Item = S>) -> S {
    terms.fold(S::from(0.0), |sum, term| sum + term)
}

/// `100 (k + sum (x - 1/2)^2 - cos(20 pi (x - 1/2)))`.
fn rough<S: Scalar>(x: &[S]) -> S {
    let term = |x: &S| {
        let d = *x - 0.5;
        d * d - (d * (20.0 * PI)).cos() + 1.0
    };
    sum(x.iter().map(term)) * 100.0
}

fn smooth<S: Scalar>(x: &[S]) -> S {
    sum(x.iter().map(|x| (*x - 0.5) * (*x - 0.5)))
}

/// Returns the point of the sphere of radius `1 + g` at two angles.
fn on_sphere<S: Scalar>(g: S, a: S, b: S) -> Vec<S> {
    let r = g + 1.0;
    let ((sa, ca), (sb, cb)) = ((a * FRAC_PI_2).sin_cos(), (b * FRAC_PI_2).sin_cos());
    vec![r * ca * cb, r * ca * sb, r * sa]
}

fn dtlz1<S: Scalar>(x: &[S]) -> Vec<S> {
    let half = (rough(&x[2..]) + 1.0) * 0.5;
    vec![half * x[0] * x[1], half * x[0] * (-x[1] + 1.0), half * (-x[0] + 1.0)]
}

fn dtlz2<S: Scalar>(x: &[S]) -> Vec<S> {
    on_sphere(smooth(&x[2..]), x[0], x[1])
}

fn dtlz3<S: Scalar>(x: &[S]) -> Vec<S> {
    on_sphere(rough(&x[2..]), x[0], x[1])
}

fn dtlz4<S: Scalar>(x: &[S]) -> Vec<S> {
    on_sphere(smooth(&x[2..]), x[0].powf(100.0), x[1].powf(100.0))
}

/// Compresses the second angle towards its centre near the front.
fn squeezed<S: Scalar>(g: S, x: &[S]) -> Vec<S> {
    on_sphere(g, x[0], (g * x[1] * 2.0 + 1.0) / ((g + 1.0) * 2.0))
}

fn dtlz5<S: Scalar>(x: &[S]) -> Vec<S> {
    squeezed(smooth(&x[2..]), x)
}

fn dtlz6<S: Scalar>(x: &[S]) -> Vec<S> {
    squeezed(sum(x[2..].iter().map(|x| x.powf(0.1))), x)
}

#[allow(clippy::cast_precision_loss)]
fn dtlz7<S: Scalar>(x: &[S]) -> Vec<S> {
    let g = sum(x[2..].iter().copied()) * (9.0 / (x.len() - 2) as f64) + 2.0;
    let waves = sum(x[..2].iter().map(|f| *f * ((*f * (3.0 * PI)).sin() + 1.0)));
    vec![x[0], x[1], g * 3.0 - waves]
}

/// Returns lattice points of the triangle.
#[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn lattice(count: usize) -> Vec<Vec<f64>> {
    let d = (2.0 * count as f64).sqrt() as usize;
    let share = |i: usize| i as f64 / d as f64;
    (0..=d).flat_map(|i| (0..=d - i).map(move |j| vec![share(i), share(j), share(d - i - j)])).collect()
}

fn plane_front(count: usize) -> Vec<Vec<f64>> {
    lattice(count).into_iter().map(|p| p.into_iter().map(|x| 0.5 * x).collect()).collect()
}

fn sphere_front(count: usize) -> Vec<Vec<f64>> {
    let on_sphere = |p: Vec<f64>| {
        let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        p.into_iter().map(|x| x / length).collect()
    };
    lattice(count).into_iter().map(on_sphere).collect()
}

fn curve_front(count: usize) -> Vec<Vec<f64>> {
    evenly(0.0, 1.0, count).map(|a| on_sphere(0.0, a, 0.5)).collect()
}

/// Returns the non-dominated points of the surface over a grid.
#[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn pieces_front(count: usize) -> Vec<Vec<f64>> {
    let side = (3.0 * count as f64).sqrt() as usize;
    // A coordinate of this front also lies on the one-dimensional front.
    let line = |f: &f64| vec![*f, -f * (1.0 + math::sin(3.0 * PI * f))];
    let coarse: Vec<f64> = evenly(0.0, 0.86, 2 * side).collect();
    let kept: Vec<f64> = best_of(&coarse.iter().map(line).collect::<Vec<_>>()).into_iter().map(|p| p[0]).collect();
    let height = |f: f64| f * (1.0 + math::sin(3.0 * PI * f));
    kept.iter().flat_map(|&a| kept.iter().map(move |&b| vec![a, b, 6.0 - height(a) - height(b)])).collect()
}
