//! `wfg`: two objectives that combine a shape with transformations: bias, flat regions, deception, many basins,
//! dependence between variables.

use std::f64::consts::{FRAC_PI_2, PI};

use mops_language::Scalar;

use super::definition::{Points, best_of, evenly, known, problem, sampled};
use crate::{Problem, Suite};

pub(crate) const SUITE: Suite = Suite {
    name: "wfg",
    about: "the nine problems of Huband, Hingston, Barone and While, with two objectives",
    source: "S. Huband, P. Hingston, L. Barone, L. While, IEEE Transactions on Evolutionary Computation 10 (2006) 477-506",
    accuracy: 0.05,
    budget: |_| 30_000,
    problems: || {
        // Area of the box minus a quarter of an ellipse, or a triangle.
        let ellipse = || known(&REFERENCE, BOX - 2.0 * PI, concave_front);
        let many = |points: Points| sampled(&REFERENCE, 20_000, points);
        let named = |name: &str, functions, front| -> Problem {
            #[allow(clippy::cast_precision_loss)]
            let bounds = (1..=POSITION + DISTANCE).map(|i| [0.0, 2.0 * i as f64]).collect();
            problem(name, bounds, functions, front)
        };
        vec![
            named("WFG1", (wfg1, wfg1), many(mixed_front)),
            named("WFG2", (wfg2, wfg2), many(disconnected_front)),
            named("WFG3", (wfg3, wfg3), known(&REFERENCE, BOX - 4.0, linear_front)),
            named("WFG4", (wfg4, wfg4), ellipse()),
            named("WFG5", (wfg5, wfg5), ellipse()),
            named("WFG6", (wfg6, wfg6), ellipse()),
            named("WFG7", (wfg7, wfg7), ellipse()),
            named("WFG8", (wfg8, wfg8), ellipse()),
            named("WFG9", (wfg9, wfg9), ellipse()),
        ]
    },
};

/// Number of variables that determine the position along the front.
const POSITION: usize = 2;

/// Number of variables that determine the distance from the front.
const DISTANCE: usize = 20;

/// Reference point, a tenth beyond the ends of the fronts.
const REFERENCE: [f64; 2] = [2.2, 4.4];

const BOX: f64 = 2.2 * 4.4;

/// Objectives `D x_M + S_m h_m(x_1)` with `D = 1` and `S = (2, 4)` from the two underlying parameters.
fn objectives<S: Scalar>([t1, t2]: [S; 2], shape: fn(S) -> [S; 2]) -> Vec<S> {
    // x_1 = max(t_2, A_1)(t_1 - 1/2) + 1/2 with A_1 = 1.
    let [h1, h2] = shape(t1);
    vec![t2 + h1 * 2.0, t2 + h2 * 4.0]
}

fn mixed<S: Scalar>(x: S) -> [S; 2] {
    [convex(x), -x - (x * (10.0 * PI) + FRAC_PI_2).cos() / (10.0 * PI) + 1.0]
}

fn disconnected<S: Scalar>(x: S) -> [S; 2] {
    let wave = (x * (5.0 * PI)).cos();
    [convex(x), -(x * wave * wave) + 1.0]
}

fn linear<S: Scalar>(x: S) -> [S; 2] {
    [x, -x + 1.0]
}

fn concave<S: Scalar>(x: S) -> [S; 2] {
    let (sin, cos) = (x * FRAC_PI_2).sin_cos();
    [sin, cos]
}

/// First of the convex shapes.
fn convex<S: Scalar>(x: S) -> S {
    -(x * FRAC_PI_2).cos() + 1.0
}

/// Variables divided by their ranges: `y_i = z_i / (2 i)`.
#[allow(clippy::cast_precision_loss)]
fn unit<S: Scalar>(z: &[S]) -> Vec<S> {
    z.iter().enumerate().map(|(i, z)| within(*z / (2.0 * (i + 1) as f64))).collect()
}

/// Limits a number to `[0, 1]`, which rounding errors may violate.
fn within<S: Scalar>(y: S) -> S {
    if y.value() < 0.0 {
        S::from(0.0)
    } else if y.value() > 1.0 {
        S::from(1.0)
    } else {
        y
    }
}

/// `b_flat`: the value `a` from `b` to `c`.
fn flat<S: Scalar>(y: S, a: f64, b: f64, c: f64) -> S {
    let below = (y.value() - b).floor().min(0.0);
    let above = (c - y.value()).floor().min(0.0);
    within((-y + b) * (below * a / b) - (y - c) * (above * (1.0 - a) / (1.0 - c)) + a)
}

/// `b_param`: a power that depends on another parameter, with the constants used by all problems.
fn dependent<S: Scalar>(y: S, u: S) -> S {
    const A: f64 = 0.98 / 49.98;
    const B: f64 = 0.02;
    const C: f64 = 50.0;
    let v = -((u * -2.0 + 1.0) * ((0.5 - u.value()).floor() + A).abs()) + A;
    if y.value() > 0.0 { within((y.ln() * (v * (C - B) + B)).exp()) } else { S::from(0.0) }
}

/// `s_linear`: 0 at `a`, increasing to both sides.
fn shifted<S: Scalar>(y: S) -> S {
    const A: f64 = 0.35;
    within((y - A).abs() / ((A - y.value()).floor() + A).abs())
}

/// `s_decept`: 0 at `a` in a narrow valley of width `2 b`; elsewhere descent leads to the value `c` at the ends.
fn deceptive<S: Scalar>(y: S) -> S {
    const A: f64 = 0.35;
    const B: f64 = 0.001;
    const C: f64 = 0.05;
    let low = (y.value() - A + B).floor() * (1.0 - C + (A - B) / B) / (A - B);
    let high = (A + B - y.value()).floor() * (1.0 - C + (1.0 - A - B) / B) / (1.0 - A - B);
    within(((y - A).abs() - B) * (low + high + 1.0 / B) + 1.0)
}

/// `s_multi`: 0 at 0.35, with `a` basins, shallower for larger `b`.
fn rough<S: Scalar>(y: S, a: f64, b: f64) -> S {
    const C: f64 = 0.35;
    let d = (y - C).abs() / (2.0 * ((C - y.value()).floor() + C));
    let wave = ((-d + 0.5) * ((4.0 * a + 2.0) * PI)).cos();
    within((wave + d * d * (4.0 * b) + 1.0) / (b + 2.0))
}

/// `r_sum` with weights.
fn weighted<S: Scalar>(y: &[S], weight: impl Fn(usize) -> f64) -> S {
    let total: f64 = (0..y.len()).map(&weight).sum();
    within(y.iter().enumerate().fold(S::from(0.0), |sum, (i, y)| sum + *y * weight(i)) / total)
}

/// `r_sum` with equal weights.
fn mean<S: Scalar>(y: &[S]) -> S {
    weighted(y, |_| 1.0)
}

/// `r_nonsep` of degree `a`.
#[allow(clippy::cast_precision_loss)]
fn entangled<S: Scalar>(y: &[S], a: usize) -> S {
    let n = y.len();
    let half = a.div_ceil(2) as f64;
    let mut sum = S::from(0.0);
    for j in 0..n {
        sum += y[j];
        for k in 0..a - 1 {
            sum += (y[j] - y[(1 + j + k) % n]).abs();
        }
    }
    within(sum / (n as f64 / a as f64 * half * (1.0 + 2.0 * a as f64 - 2.0 * half)))
}

/// Transforms the variables that determine the distance from the front.
fn distances<S: Scalar>(y: &mut [S], f: impl Fn(S) -> S) {
    y[POSITION..].iter_mut().for_each(|y| *y = f(*y));
}

/// Reduces each of the two groups of variables to one number.
fn reduced<S: Scalar>(y: &[S], f: impl Fn(&[S]) -> S) -> [S; 2] {
    [f(&y[..POSITION]), f(&y[POSITION..])]
}

fn wfg1<S: Scalar>(z: &[S]) -> Vec<S> {
    biased(unit(z))
}

/// First problem, over the unit ranges.
#[allow(clippy::cast_precision_loss)]
fn biased<S: Scalar>(mut y: Vec<S>) -> Vec<S> {
    distances(&mut y, |y| flat(shifted(y), 0.8, 0.75, 0.85));
    let y: Vec<S> = y.iter().map(|y| if y.value() > 0.0 { y.powf(0.02) } else { S::from(0.0) }).collect();
    let t = [
        weighted(&y[..POSITION], |i| 2.0 * (i + 1) as f64),
        weighted(&y[POSITION..], |i| 2.0 * (POSITION + i + 1) as f64),
    ];
    objectives(t, mixed)
}

/// Transformations of the second and third problem.
fn in_pairs<S: Scalar>(z: &[S]) -> [S; 2] {
    let mut y = unit(z);
    distances(&mut y, shifted);
    let pairs: Vec<S> = y[POSITION..].chunks(2).map(|pair| entangled(pair, 2)).collect();
    [mean(&y[..POSITION]), mean(&pairs)]
}

fn wfg2<S: Scalar>(z: &[S]) -> Vec<S> {
    objectives(in_pairs(z), disconnected)
}

fn wfg3<S: Scalar>(z: &[S]) -> Vec<S> {
    objectives(in_pairs(z), linear)
}

fn wfg4<S: Scalar>(z: &[S]) -> Vec<S> {
    let y: Vec<S> = unit(z).into_iter().map(|y| rough(y, 30.0, 10.0)).collect();
    objectives(reduced(&y, mean), concave)
}

fn wfg5<S: Scalar>(z: &[S]) -> Vec<S> {
    let y: Vec<S> = unit(z).into_iter().map(deceptive).collect();
    objectives(reduced(&y, mean), concave)
}

fn wfg6<S: Scalar>(z: &[S]) -> Vec<S> {
    let mut y = unit(z);
    distances(&mut y, shifted);
    objectives(reduced(&y, |y| entangled(y, y.len())), concave)
}

fn wfg7<S: Scalar>(z: &[S]) -> Vec<S> {
    let before = unit(z);
    let mut y = before.clone();
    (0..POSITION).for_each(|i| y[i] = dependent(before[i], mean(&before[i + 1..])));
    distances(&mut y, shifted);
    objectives(reduced(&y, mean), concave)
}

fn wfg8<S: Scalar>(z: &[S]) -> Vec<S> {
    let before = unit(z);
    let mut y = before.clone();
    (POSITION..y.len()).for_each(|i| y[i] = dependent(before[i], mean(&before[..i])));
    distances(&mut y, shifted);
    objectives(reduced(&y, mean), concave)
}

fn wfg9<S: Scalar>(z: &[S]) -> Vec<S> {
    let before = unit(z);
    let mut y = before.clone();
    (0..y.len() - 1).for_each(|i| y[i] = dependent(before[i], mean(&before[i + 1..])));
    y[..POSITION].iter_mut().for_each(|y| *y = deceptive(*y));
    distances(&mut y, |y| rough(y, 30.0, 95.0));
    objectives(reduced(&y, |y| entangled(y, y.len())), concave)
}

/// Returns points of a shape, at zero distance from it.
fn along(shape: fn(f64) -> [f64; 2], count: usize) -> Vec<Vec<f64>> {
    evenly(0.0, 1.0, count).map(|x| objectives([x, 0.0], shape)).collect()
}

fn mixed_front(count: usize) -> Vec<Vec<f64>> {
    along(mixed, count)
}

fn linear_front(count: usize) -> Vec<Vec<f64>> {
    along(linear, count)
}

fn concave_front(count: usize) -> Vec<Vec<f64>> {
    along(concave, count)
}

/// Returns the non-dominated points of the curve.
fn disconnected_front(count: usize) -> Vec<Vec<f64>> {
    best_of(&along(disconnected, 4 * count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mops_math as math;

    /// Power to which [`dependent`] raises a parameter.
    fn power(u: f64) -> f64 {
        0.02 + 49.98 * (0.98 / 49.98 - (1.0 - 2.0 * u) * ((0.5 - u).floor() + 0.98 / 49.98).abs())
    }

    /// Variables on the front over the unit ranges, from those that determine the position, as the source gives them
    /// for each problem.
    fn optimal(name: &str, position: [f64; POSITION]) -> Vec<f64> {
        let n = POSITION + DISTANCE;
        let mut y = vec![0.35; n];
        y[..POSITION].copy_from_slice(&position);
        let mean = |y: &[f64]| y.iter().sum::<f64>() / y.len() as f64;
        match name {
            "WFG8" => (POSITION..n).for_each(|i| y[i] = math::powf(0.35, 1.0 / power(mean(&y[..i])))),
            "WFG9" => (POSITION..n - 1).rev().for_each(|i| y[i] = math::powf(0.35, 1.0 / power(mean(&y[i + 1..])))),
            _ => {}
        }
        y
    }

    /// Objectives at variables over the unit ranges.
    fn at(problem: &Problem, y: &[f64]) -> Vec<f64> {
        // Rounding errors of the ranges matter: the first problem turns 1e-16 into 0.5.
        if problem.name == "WFG1" {
            return biased(y.to_vec());
        }
        let values = y.iter().zip(&problem.bounds).map(|(y, [_, high])| high * y);
        problem.functions.values(&values.collect::<Vec<_>>())
    }

    #[test]
    fn the_published_solutions_lie_on_the_fronts() {
        for problem in (SUITE.problems)() {
            for i in 0..=20 {
                let a = f64::from(i) / 20.0;
                let f = at(&problem, &optimal(&problem.name, [a, 0.3 + 0.4 * a]));
                let off = match problem.name.as_str() {
                    // x_1 from the first objective, and the second objective there.
                    "WFG1" | "WFG2" => {
                        let x = math::acos(1.0 - 0.5 * f[0]) / FRAC_PI_2;
                        let shape = if problem.name == "WFG1" { mixed(x) } else { disconnected(x) };
                        f[1] - 4.0 * shape[1]
                    }
                    "WFG3" => f[0] / 2.0 + f[1] / 4.0 - 1.0,
                    _ => math::powi(f[0] / 2.0, 2) + math::powi(f[1] / 4.0, 2) - 1.0,
                };
                assert!(off.abs() < 1e-6, "{}: {f:?} {off}", problem.name);
            }
        }
    }

    #[test]
    fn away_from_the_solutions_objectives_are_worse() {
        for problem in (SUITE.problems)() {
            let mut y = optimal(&problem.name, [0.4, 0.6]);
            let best = at(&problem, &y);
            let last = y.len() - 1;
            y[last] *= 0.5;
            let away = at(&problem, &y);
            assert!(away[0] + away[1] > best[0] + best[1] + 1e-4, "{}: {best:?} {away:?}", problem.name);
        }
    }

    #[test]
    fn transformations_have_the_values_of_their_definitions() {
        assert_eq!(
            (flat(0.8, 0.8, 0.75, 0.85), flat(0.0, 0.8, 0.75, 0.85), flat(1.0, 0.8, 0.75, 0.85)),
            (0.8, 0.0, 1.0)
        );
        assert!((deceptive(0.35_f64)).abs() < 1e-9 && (deceptive(0.0_f64) - 0.05).abs() < 1e-9);
        assert!((deceptive(1.0_f64) - 0.05).abs() < 1e-9 && (deceptive(0.349_f64) - 1.0).abs() < 1e-9);
        assert!(rough(0.35_f64, 30.0, 10.0).abs() < 1e-12 && (rough(0.0_f64, 30.0, 10.0) - 1.0).abs() < 1e-12);
        assert!((dependent(0.25_f64, 0.5) - 0.25).abs() < 1e-9, "at the middle the power is 1");
        assert!((entangled(&[1.0_f64, 0.0], 2) - 1.0).abs() < 1e-12 && entangled(&[0.0_f64, 0.0], 2) == 0.0);
    }
}
