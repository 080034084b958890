//! Curve-fitting problems: 25, 57, 70 and 105.

use mops_language::Scalar;
use mops_math as math;

use super::notation::{hs, within};
use crate::arithmetic::{c, power, sq, sum};
use crate::formula::Functions;
use crate::problem::{Problem, Sense};

pub(super) fn problems() -> Vec<(u32, Problem)> {
    let squares = |(number, problem): (u32, Problem)| (number, Problem { sense: Sense::Squares, ..problem });
    vec![
        // At the initial guess all derivatives vanish.
        squares(within(
            &[[0.1, 100.0], [0.0, 25.6], [0.0, 5.0]],
            hs(25, &[100.0, 12.5, 3.0], [0, 0], 0.0, Functions::of(hs25, hs25)),
        )),
        squares(within(
            &[[0.4, f64::INFINITY], [-4.0, f64::INFINITY]],
            hs(57, &[0.42, 5.0], [1, 0], [0.02845966972, 0.03064627605], Functions::of(hs57, hs57)),
        )),
        squares(within(
            &[[1e-5, 100.0], [1e-5, 100.0], [1e-5, 1.0], [1e-5, 100.0]],
            hs(70, &[2.0, 4.0, 0.04, 2.0], [1, 0], 0.0074984636, Functions::of(hs70, hs70)),
        )),
        within(
            &[
                [0.001, 0.499],
                [0.001, 0.499],
                [100.0, 180.0],
                [130.0, 210.0],
                [170.0, 240.0],
                [5.0, 25.0],
                [5.0, 25.0],
                [5.0, 25.0],
            ],
            hs(
                105,
                &[0.1, 0.2, 100.0, 125.0, 175.0, 11.2, 13.2, 15.8],
                [1, 0],
                [1136.3073, 1138.41],
                Functions::of(hs105, hs105),
            ),
        ),
    ]
}

/// Weibull curve at 99 points.
fn hs25<S: Scalar>(x: &[S]) -> Vec<S> {
    let at = |i: u32| {
        let share = 0.01 * f64::from(i);
        let u = 25.0 + math::powf(-50.0 * math::ln(share), 2.0 / 3.0);
        (-power(-x[1] + u, x[2]) / x[0]).exp() - share
    };
    (1..100).map(at).collect()
}

/// Available chlorine over time.
fn hs57<S: Scalar>(x: &[S]) -> Vec<S> {
    // Time in weeks and number of measurements; the measured values are in the same order.
    const WEEKS: [(f64, usize); 18] = [
        (8.0, 2),
        (10.0, 4),
        (12.0, 4),
        (14.0, 3),
        (16.0, 3),
        (18.0, 2),
        (20.0, 3),
        (22.0, 3),
        (24.0, 3),
        (26.0, 3),
        (28.0, 2),
        (30.0, 3),
        (32.0, 2),
        (34.0, 1),
        (36.0, 2),
        (38.0, 2),
        (40.0, 1),
        (42.0, 1),
    ];
    const SHARE: [f64; 44] = [
        0.49, 0.49, 0.48, 0.47, 0.48, 0.47, 0.46, 0.46, 0.45, 0.43, 0.45, 0.43, 0.43, 0.44, 0.43, 0.43, 0.46, 0.45,
        0.42, 0.42, 0.43, 0.41, 0.41, 0.40, 0.42, 0.40, 0.40, 0.41, 0.40, 0.41, 0.41, 0.40, 0.40, 0.40, 0.38, 0.41,
        0.40, 0.40, 0.41, 0.38, 0.40, 0.40, 0.39, 0.39,
    ];
    let times = WEEKS.iter().flat_map(|&(week, count)| std::iter::repeat_n(week, count));
    let residual = |(share, week): (&f64, f64)| -x[0] - (-x[0] + 0.49) * (-x[1] * (week - 8.0)).exp() + *share;
    let mut rows: Vec<S> = SHARE.iter().zip(times).map(residual).collect();
    rows.push(-x[1] * 0.49 + x[0] * x[1] + 0.09);
    rows
}

/// Two gamma densities fitted to 19 concentrations. N.B.: the optimum in the book corresponds to Stirling's factor in
/// the denominator and 7.658 throughout; the formula printed there has other signs and digits.
fn hs70<S: Scalar>(x: &[S]) -> Vec<S> {
    const Y: [f64; 19] = [
        0.00189, 0.1038, 0.268, 0.506, 0.577, 0.604, 0.725, 0.898, 0.947, 0.845, 0.702, 0.528, 0.385, 0.257, 0.159,
        0.0869, 0.0453, 0.01509, 0.00189,
    ];
    let b = x[2] + (-x[2] + 1.0) * x[3];
    // 2 pi with the digits of the book.
    #[allow(clippy::approx_constant)]
    let density = |weight: S, shape: S, rate: S, time: f64| {
        let t = time / 7.658;
        let stirling = c::<S>(1.0) + c::<S>(1.0) / (shape * 12.0);
        let scale = power(rate, shape) * (shape / 6.2832).sqrt() * power(c(t), shape - 1.0);
        weight / stirling * scale * (shape - rate * shape * t).exp()
    };
    let residual = |(i, y): (u32, &f64)| {
        let time = if i == 0 { 0.1 } else { f64::from(i) };
        density(x[2], x[1], b, time) + density(-x[2] + 1.0, x[0], b / x[3], time) - *y
    };
    let mut rows: Vec<S> = (0..).zip(&Y).map(residual).collect();
    rows.push(-b);
    rows
}

/// Likelihood of a mixture of three normal distributions, for 235 weights.
fn hs105<S: Scalar>(x: &[S]) -> Vec<S> {
    const COUNT: [(f64, f64); 30] = [
        (95.0, 1.0),
        (105.0, 1.0),
        (110.0, 4.0),
        (115.0, 4.0),
        (120.0, 15.0),
        (125.0, 15.0),
        (130.0, 15.0),
        (135.0, 13.0),
        (140.0, 21.0),
        (145.0, 12.0),
        (150.0, 17.0),
        (155.0, 4.0),
        (160.0, 20.0),
        (165.0, 8.0),
        (170.0, 17.0),
        (175.0, 8.0),
        (180.0, 6.0),
        (185.0, 6.0),
        (190.0, 7.0),
        (195.0, 4.0),
        (200.0, 3.0),
        (205.0, 3.0),
        (210.0, 8.0),
        (215.0, 1.0),
        (220.0, 6.0),
        (230.0, 5.0),
        (235.0, 1.0),
        (240.0, 7.0),
        (245.0, 1.0),
        (250.0, 2.0),
    ];
    let share = [x[0], x[1], -x[0] - x[1] + 1.0];
    let likelihood = |weight: f64| {
        let part = |k: usize| share[k] / x[k + 5] * (-sq((-x[k + 2] + weight) / x[k + 5]) * 0.5).exp();
        (part(0) + part(1) + part(2)) / std::f64::consts::TAU.sqrt()
    };
    vec![-sum(COUNT.iter().map(|&(weight, count)| likelihood(weight).ln() * count)), x[0] + x[1] - 1.0]
}
