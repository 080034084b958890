//! Chemical engineering problems as exact penalty functions; linear constraints remain constraints.
//!
//! N.B.: with bounds as in the report; its program has x10 of HS114 in [140, 160], and no bounds in Dembo5.

use mops_language::Scalar;

use crate::arithmetic::{penalised, sq};
use crate::formula::Functions;
use crate::problem::Problem;

pub(super) fn problems() -> Vec<Problem> {
    vec![
        Problem {
            bounds: HS114.map(|[_, low, high]| [low, high]).to_vec(),
            inequalities: 4,
            equalities: 1,
            ..Problem::new("HS114", &HS114.map(|v| v[0]), -1768.806964, Functions::of(hs114, hs114))
        },
        Problem {
            bounds: DEMBO3.map(|[_, low, high]| [low, high]).to_vec(),
            inequalities: 2,
            ..Problem::new("Dembo3", &DEMBO3.map(|v| v[0]), 1227.226076, Functions::of(dembo3, dembo3))
        },
        Problem {
            bounds: DEMBO5.map(|[_, low, high]| [low, high]).to_vec(),
            inequalities: 3,
            ..Problem::new("Dembo5", &DEMBO5.map(|v| v[0]), 7049.248021, Functions::of(dembo5, dembo5))
        },
        Problem {
            bounds: DEMBO7.map(|[_, low, high]| [low, high]).to_vec(),
            inequalities: 1,
            ..Problem::new("Dembo7", &DEMBO7.map(|v| v[0]), 174.786994, Functions::of(dembo7, dembo7))
        },
    ]
}

/// Initial guess, lower and upper bound.
const HS114: [[f64; 3]; 10] = [
    [1745.0, 1e-5, 2000.0],
    [12000.0, 1e-5, 16000.0],
    [110.0, 1e-5, 120.0],
    [3048.0, 1e-5, 5000.0],
    [1974.0, 1e-5, 2000.0],
    [89.2, 85.0, 93.0],
    [92.8, 90.0, 95.0],
    [8.0, 3.0, 12.0],
    [3.6, 1.2, 4.0],
    [145.0, 145.0, 162.0],
];

/// Alkylation: every equality becomes a pair of inequalities, some with a tolerance of 1 %.
fn hs114<S: Scalar>(x: &[S]) -> Vec<S> {
    let f = x[0] * 5.04 + x[1] * 0.035 + x[2] * 10.0 + x[4] * 3.36 - x[3] * x[6] * 0.063;
    let yield_of = x[0] * 1.12 + x[0] * x[7] * (x[7] * -0.00667 + 0.13167);
    let octane = x[7] * (x[7] * -0.038 + 1.098) + 57.425 + x[5] * 0.325;
    let acid = x[2] * 98000.0 / (x[3] * x[8] + x[2] * 1000.0) - x[5];
    let ratio = (x[1] + x[4]) / x[0] - x[7];
    let rows = [
        f,
        yield_of - x[3] / 0.99,
        -yield_of + x[3] * 0.99,
        octane - x[6] / 0.99,
        -octane + x[6] * 0.99,
        acid,
        -acid,
        ratio,
        -ratio,
    ];
    let linear = vec![
        x[8] * 0.9 + x[9] * 0.222 - 35.82,
        -x[8] / 0.9 - x[9] * 0.222 + 35.82,
        -x[6] * 3.0 + x[9] * 0.99 + 133.0,
        x[6] * 3.0 - x[9] / 0.99 - 133.0,
        -x[0] + x[3] * 1.22 - x[4],
    ];
    [penalised(500.0, &rows), linear].concat()
}

const DEMBO3: [[f64; 3]; 7] = [
    [1745.0, 1.0, 2000.0],
    [110.0, 1.0, 120.0],
    [3048.0, 1.0, 5000.0],
    [89.0, 85.0, 93.0],
    [92.0, 90.0, 95.0],
    [8.0, 3.0, 12.0],
    [145.0, 145.0, 162.0],
];

/// Alkylation as a geometric program.
fn dembo3<S: Scalar>(x: &[S]) -> Vec<S> {
    let f = x[0] * 1.715 + x[0] * x[5] * 0.035 + x[2] * 4.0565 + x[1] * 10.0 + 3000.0 - x[2] * x[4] * 0.063;
    let share = x[1] / x[2];
    let over = |number: f64, x: S| S::from(number) / x;
    let rows = [
        f,
        sq(x[5]) * 0.0059553571 + x[2] / x[0] * 0.88392857 - x[5] * 0.1175625 - 1.0,
        (x[5] * 0.1303533 - sq(x[5]) * 0.0066033 + 1.1088) * x[0] / x[2] - 1.0,
        sq(x[5]) * 6.6173269e-4 + x[4] * 0.017239878 - x[3] * 0.0056595559 - x[5] * 0.019120592 - 1.0,
        (x[5] * 1.08702 + x[3] * 0.32175 - sq(x[5]) * 0.03762 + 56.85075) / x[4] - 1.0,
        x[6] * 0.006198 + (over(2462.3121, x[3]) - 25.125634) * share - 1.0,
        ((over(-489510.0, x[3]) + 5000.0) * share + 161.18996) / x[6] - 1.0,
        (x[6] * 0.33 + 44.333333) / x[4] - 1.0,
        (x[0] * 0.819672 + 0.819672) / x[2] - 1.0,
        (over(24500.0, x[3]) - 250.0) * share - 1.0,
        (x[2] / x[1] * 1.2244898e-5 + 0.010204082) * x[3] - 1.0,
        x[0] * x[5] * 6.25e-5 + x[0] * 6.25e-5 - x[2] * 7.625e-5 - 1.0,
        (x[2] * 1.22 + 1.0) / x[0] - x[5] - 1.0,
    ];
    let linear = vec![x[4] * 0.022556 - x[6] * 0.007595 - 1.0, x[2] * 0.00061 - x[0] * 0.0005 - 1.0];
    [penalised(1e5, &rows), linear].concat()
}

const DEMBO5: [[f64; 3]; 8] = [
    [5000.0, 100.0, 10000.0],
    [5000.0, 1000.0, 10000.0],
    [5000.0, 1000.0, 10000.0],
    [200.0, 10.0, 1000.0],
    [350.0, 10.0, 1000.0],
    [150.0, 10.0, 1000.0],
    [225.0, 10.0, 1000.0],
    [425.0, 10.0, 1000.0],
];

/// Heat exchangers.
fn dembo5<S: Scalar>(x: &[S]) -> Vec<S> {
    let rows = [
        x[0] + x[1] + x[2],
        ((x[3] * 833.33252 - 83333.333) / x[0] + 100.0) / x[5] - 1.0,
        ((x[4] - x[3]) * 1250.0 / x[1] + x[3]) / x[6] - 1.0,
        ((x[4] * -2500.0 + 1.25e6) / x[2] + x[4]) / x[7] - 1.0,
    ];
    let linear = vec![(x[3] + x[5]) * 0.0025 - 1.0, (x[4] + x[6] - x[3]) * 0.0025 - 1.0, (x[7] - x[4]) * 0.01 - 1.0];
    [penalised(1e5, &rows), linear].concat()
}

const DEMBO7: [[f64; 3]; 16] = [
    [0.8, 0.1, 0.9],
    [0.83, 0.1, 0.9],
    [0.85, 0.1, 0.9],
    [0.87, 0.1, 0.9],
    [0.9, 0.9, 1.0],
    [0.1, 1e-4, 0.1],
    [0.12, 0.1, 0.9],
    [0.19, 0.1, 0.9],
    [0.25, 0.1, 0.9],
    [0.29, 0.1, 0.9],
    [512.0, 1.0, 10000.0],
    [13.1, 1e-6, 5000.0],
    [71.8, 1.0, 5000.0],
    [640.0, 500.0, 10000.0],
    [650.0, 500.0, 10000.0],
    [5.7, 1e-6, 5000.0],
];

/// Separation in five stages.
fn dembo7<S: Scalar>(x: &[S]) -> Vec<S> {
    let flow: S = x[11] + x[12] + x[13] + x[14] + x[15];
    let carried = x[0] * x[11] + x[1] * x[12] + x[2] * x[13] + x[3] * x[14] + x[4] * x[15];
    let mut rows = vec![flow * 1.262626 - carried * 1.23106];
    rows.extend((0..5).map(|i| x[i] * ((x[i] * -0.00975 + 0.03475) / x[i + 5] + 0.975) - 1.0));
    rows.extend([
        (x[5] + (x[0] - x[5]) * x[11] / x[10]) / x[6] - 1.0,
        (x[6] + (x[6] - x[0]) * x[11] * 0.002) / x[7] + x[12] * (x[1] / x[7] - 1.0) * 0.002 - 1.0,
        x[7] + x[8] + x[12] * (x[7] - x[1]) * 0.002 + x[13] * (x[2] - x[8]) * 0.002 - 1.0,
        (x[8] + ((x[3] - x[7]) * x[14] + (x[9] - x[8]) * 500.0) / x[13]) / x[2] - 1.0,
        x[9] / x[3] + ((x[4] / x[3] - 1.0) * x[15] + (-x[9] / x[3] + 1.0) * 500.0) / x[14] - 1.0,
        S::from(0.9) / x[3] + x[15] * (-x[4] / x[3] + 1.0) * 0.002 - 1.0,
        x[11] / x[10] - 1.0,
        x[3] / x[4] - 1.0,
        x[2] / x[3] - 1.0,
        x[1] / x[2] - 1.0,
        x[0] / x[1] - 1.0,
        x[8] / x[9] - 1.0,
        x[7] / x[8] - 1.0,
    ]);
    [penalised(1000.0, &rows), vec![(x[10] - x[11]) * 0.002 - 1.0]].concat()
}
