//! Matrices and comparisons for the tests of linear systems.

use mops_math::{complex, stream};
use nalgebra::DMatrix;
use rand::Rng;

use super::Complex;

/// Returns a complex number.
pub fn c(re: f64, im: f64) -> Complex {
    Complex::new(re, im)
}

/// Returns a matrix of random numbers between -1 and 1.
pub fn random(rows: usize, columns: usize, seed: u64) -> DMatrix<f64> {
    let mut stream = stream(seed, "matrix");
    DMatrix::from_fn(rows, columns, |_, _| stream.random_range(-1.0..1.0))
}

/// Asserts that both lists contain the same numbers, in any order, within `tolerance`.
#[track_caller]
pub fn assert_same_set(found: &[Complex], expected: &[Complex], tolerance: f64) {
    let mut rest = found.to_vec();
    assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
    for z in expected {
        let nearest =
            (0..rest.len()).min_by(|&i, &j| complex::norm(rest[i] - z).total_cmp(&complex::norm(rest[j] - z))).unwrap();
        let found = rest.swap_remove(nearest);
        assert!(complex::norm(found - z) <= tolerance, "{found} is not {z}: {found:?}");
    }
}

/// Asserts that two numbers agree within `tolerance`.
#[track_caller]
pub fn assert_near(number: f64, expected: f64, tolerance: f64) {
    assert!((number - expected).abs() <= tolerance, "{number} is not {expected} within {tolerance}");
}

/// Returns `A` and `B` of the Furuta pendulum about its upright position, states `phi, phi', theta, theta'`.
///
/// Source: Greybox Identification and Control Design with Dymola (master thesis, Lund Institute of Technology), section
/// 5.2.
pub fn furuta() -> (DMatrix<f64>, DMatrix<f64>) {
    let a =
        [[0.0, 1.0, 0.0, 0.0], [-0.1082, 0.0, -25.4814, 0.0255], [0.0, 0.0, 0.0, 1.0], [0.0756, 0.0, 45.7597, -0.0458]];
    (DMatrix::from_fn(4, 4, |i, j| a[i][j]), DMatrix::from_column_slice(4, 1, &[0.0, 1444.1, 0.0, -1008.5]))
}
