//! Problems with few functions of few variables.

use mops_language::Scalar;
use mops_math as math;

use crate::arithmetic::{c, cube, fourth, sq, sum};
use crate::formula::Functions;
use crate::problem::Problem;

pub(super) fn problems() -> Vec<Problem> {
    vec![
        Problem::new("CB2", &[2.0, 2.0], 1.952224494, Functions::of(cb2, cb2)),
        Problem::new("WF", &[3.0, 1.0], 0.0, Functions::of(wf, wf)),
        Problem::new("SPIRAL", &[1.41831, -4.79462], 0.0, Functions::of(spiral, spiral)),
        Problem::new("EVD52", &[1.0; 3], 3.5997193, Functions::of(evd52, evd52)),
        Problem::new("Transformer", &TRANSFORMER, [0.1769246507, 0.197290627], Functions::of(transformer, transformer)),
        Problem::new("Polak2", &POLAK2, 54.59815003, Functions::of(polak2, polak2)),
        Problem::new("Polak3", &[1.0; 11], 261.0825806, Functions::of(polak3, polak3)),
    ]
}

/// Charalambous and Conn.
fn cb2<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![sq(x[0]) + fourth(x[1]), sq(-x[0] + 2.0) + sq(-x[1] + 2.0), (x[1] - x[0]).exp() * 2.0]
}

/// Womersley and Fletcher.
fn wf<S: Scalar>(x: &[S]) -> Vec<S> {
    let (q, s) = (x[0] * 10.0 / (x[0] + 0.1), sq(x[1]) * 2.0);
    [x[0] + q, q - x[0], x[0] - q].map(|y| (y + s) * 0.5).to_vec()
}

fn spiral<S: Scalar>(x: &[S]) -> Vec<S> {
    let square = sq(x[0]) + sq(x[1]);
    let radius = square.sqrt();
    let (sin, cos) = radius.sin_cos();
    [x[0] - radius * cos, x[1] - radius * sin].map(|y| sq(y) + square * 0.005).to_vec()
}

fn evd52<S: Scalar>(x: &[S]) -> Vec<S> {
    vec![
        sq(x[0]) + sq(x[1]) + sq(x[2]) - 1.0,
        sq(x[0]) + sq(x[1]) + sq(x[2] - 2.0),
        x[0] + x[1] + x[2] - 1.0,
        x[0] + x[1] - x[2] + 1.0,
        (cube(x[0]) + sq(x[1]) * 3.0 + sq(x[2] * 5.0 - x[0] + 1.0)) * 2.0,
        sq(x[0]) - x[2] * 9.0,
    ]
}

const TRANSFORMER: [f64; 6] = [0.8, 1.5, 1.2, 3.0, 0.8, 6.0];

/// Reflection coefficient `|(Z - 1) / (Z + 1)|` of a three-section transformer that matches 1 to 10, at eleven
/// frequencies. The sections have lengths `x[0], x[2], x[4]` (in quarter wavelengths) and impedances `x[1], x[3],
/// x[5]`; `Z` is the input impedance.
fn transformer<S: Scalar>(x: &[S]) -> Vec<S> {
    let reflection = |frequency: f64| {
        // Voltage and current from the load towards the source, as pairs of real and imaginary part.
        let (mut voltage, mut current) = ([c::<S>(10.0), c(0.0)], [c::<S>(1.0), c(0.0)]);
        for section in [2, 1, 0] {
            let (length, impedance) = (x[2 * section], x[2 * section + 1]);
            let (sin, cos) = (length * frequency * std::f64::consts::FRAC_PI_2).sin_cos();
            let (across, along) = (sin * impedance, sin / impedance);
            (voltage, current) = (
                [voltage[0] * cos - current[1] * across, voltage[1] * cos + current[0] * across],
                [current[0] * cos - voltage[1] * along, current[1] * cos + voltage[0] * along],
            );
        }
        let square = |z: [S; 2]| sq(z[0]) + sq(z[1]);
        let minus = [voltage[0] - current[0], voltage[1] - current[1]];
        let plus = [voltage[0] + current[0], voltage[1] + current[1]];
        (square(minus) / square(plus)).sqrt()
    };
    [0.5, 0.6, 0.7, 0.77, 0.9, 1.0, 1.1, 1.23, 1.3, 1.4, 1.5].map(reflection).to_vec()
}

const POLAK2: [f64; 10] = [100.0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1];

fn polak2<S: Scalar>(x: &[S]) -> Vec<S> {
    let rest = sq(x[0]) * 1e-8 + sq(x[2]) + sq(x[3]) * 4.0 + sum(x[4..].iter().map(|&x| sq(x)));
    [2.0, -2.0].map(|shift| (rest + sq(x[1] + shift)).exp()).to_vec()
}

#[allow(clippy::cast_precision_loss)]
fn polak3<S: Scalar>(x: &[S]) -> Vec<S> {
    let term = |i: usize, j: usize| sq(x[j] - math::sin((i + 2 * j) as f64)).exp() * (i + j + 1) as f64;
    // N.B.: the angle is i + 2 j - 1 of the report with i and j from 1, that is i + 2 j from 0.
    (0..10).map(|i| sum((0..11).map(|j| term(i, j)))).collect()
}
