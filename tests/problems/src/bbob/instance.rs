//! Random numbers, shifts and rotations that define an instance of a function.
//!
//! Source: N. Hansen, S. Finck, R. Ros, A. Auger, Real-Parameter Black-Box Optimization Benchmarking 2009: Noiseless
//! Functions Definitions, INRIA RR-6829 (2009), with the generators of the accompanying reference code (COCO).

use mops_math as math;
use std::f64::consts::PI;

/// Square matrix, by rows.
pub(crate) type Matrix = Vec<Vec<f64>>;

/// Returns uniform numbers in (0, 1): the minimal standard generator of Park and Miller (with Schrage's factorisation),
/// shuffled by a table of 32 entries as proposed by Bays and Durham.
pub(crate) fn uniform(count: usize, seed: i64) -> Vec<f64> {
    const MODULUS: i64 = 2_147_483_647;
    let mut state = seed.abs().max(1);
    let mut next = || {
        let high = state / 127_773;
        state = 16_807 * (state - high * 127_773) - 2_836 * high;
        if state < 0 {
            state += MODULUS;
        }
        state
    };
    let mut table = [0; 32];
    for i in (0..40).rev() {
        let drawn = next();
        if i < 32 {
            table[i] = drawn;
        }
    }
    let mut last = table[0];
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let mut draw = || {
        let slot = (last / 67_108_865) as usize;
        let drawn = next();
        last = std::mem::replace(&mut table[slot], drawn);
        (last as f64 / 2.147_483_647e9).max(1e-99)
    };
    (0..count).map(|_| draw()).collect()
}

/// Returns normal numbers by the Box-Muller method.
pub(crate) fn normal(count: usize, seed: i64) -> Vec<f64> {
    let u = uniform(2 * count, seed);
    let of = |i: usize| (-2.0 * math::ln(u[i])).sqrt() * math::cos(2.0 * PI * u[count + i]);
    (0..count).map(of).map(|g| if g == 0.0 { 1e-99 } else { g }).collect()
}

/// Returns a rotation: normal numbers by columns, made orthonormal by the Gram-Schmidt process.
pub(crate) fn rotation(n: usize, seed: i64) -> Matrix {
    let g = normal(n * n, seed);
    let mut columns: Vec<Vec<f64>> = g.chunks(n).map(<[f64]>::to_vec).collect();
    for i in 0..n {
        for j in 0..i {
            let along: f64 = columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum();
            let earlier = columns[j].clone();
            columns[i].iter_mut().zip(earlier).for_each(|(a, b)| *a -= along * b);
        }
        let length = columns[i].iter().map(|a| a * a).sum::<f64>().sqrt();
        columns[i].iter_mut().for_each(|a| *a /= length);
    }
    (0..n).map(|row| (0..n).map(|column| columns[column][row]).collect()).collect()
}

/// Returns the position of the optimum, on a grid of 8e-4 in [-4, 4].
pub(crate) fn optimum(n: usize, seed: i64) -> Vec<f64> {
    let on_grid = |u: f64| 8.0 * (1e4 * u).floor() / 1e4 - 4.0;
    uniform(n, seed).into_iter().map(on_grid).map(|x| if x == 0.0 { -1e-5 } else { x }).collect()
}

/// Returns the value at the optimum: the ratio of two normal numbers, limited to 1000.
pub(crate) fn least_value(seed: i64) -> f64 {
    let ratio = normal(1, seed)[0] / normal(1, seed + 1)[0];
    ((100.0 * 100.0 * ratio + 0.5).floor() / 100.0).clamp(-1000.0, 1000.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_orthonormal() {
        let r = rotation(5, 10_003);
        for i in 0..5 {
            for j in 0..5 {
                let product: f64 = (0..5).map(|k| r[i][k] * r[j][k]).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
    }
}
