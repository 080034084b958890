//! Random linear systems, compared with the matrix exponential.

use mops_math as math;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

use super::*;

/// Computes the matrix exponential by scaling and squaring of its power series.
///
/// Source: C. Moler, C. Van Loan, Nineteen dubious ways to compute the exponential of a matrix, SIAM Review 20 (1978),
/// method 3.
fn exponential(a: &DMatrix<f64>) -> DMatrix<f64> {
    let halvings = (0..64).find(|&k| a.norm() * math::powi(0.5, k) < 0.5).expect("the matrix is finite");
    let small = a * math::powi(0.5, halvings);
    let one = DMatrix::identity(a.nrows(), a.ncols());
    let series = (1..=20).rev().fold(one.clone(), |sum, k| &one + &small * sum / f64::from(k));
    (0..halvings).fold(series, |power, _| &power * &power)
}

/// Generates the number of states, entries of the matrix and initial values; a system uses as many of them as it needs.
fn systems() -> impl Strategy<Value = (usize, Vec<f64>, Vec<f64>)> {
    let entries = prop::collection::vec(prop_oneof![3 => -2.0..2.0_f64, 1 => Just(0.0), 1 => -30.0..3.0_f64], 25);
    (1..=5_usize, entries, prop::collection::vec(-1.0..1.0_f64, 5))
}

proptest! {
    #![proptest_config(mops_tiers::property(1_000))]

    #[test]
    fn a_linear_system_follows_the_matrix_exponential((n, entries, start) in systems(), stiff in any::<bool>()) {
        let a = DMatrix::from_fn(n, n, |i, j| entries[5 * i + j]);
        let row = |i: usize| (0..n).map(|j| format!("{:?}*x{j}", a[(i, j)])).collect::<Vec<_>>().join(" + ");
        let states: Vec<String> = (0..n).map(|i| format!("x{i} = '1'")).collect();
        let der: Vec<String> = (0..n).map(|i| format!("x{i} = '{}'", row(i))).collect();
        let method = if stiff { "\ntolerance = { method = 'stiff' }" } else { "" };
        let text = format!("states = {{ {} }}\nder = {{ {} }}{method}", states.join(", "), der.join(", "));
        let names: Vec<String> = (0..n).map(|i| format!("x{i}0")).collect();
        let given: Vec<(&str, f64)> = names.iter().map(String::as_str).zip(start.iter().copied()).collect();
        let x0 = DVector::from_fn(n, |i, _| start[i]);
        let response = respond(&read(&text).unwrap(), &[], &given, 2.0);
        // Errors grow at most like the solution of the system.
        let size = (0..=20).map(|k| exponential(&(&a * (0.1 * f64::from(k)))).norm()).fold(1.0, f64::max) * x0.norm().max(1e-3);
        for t in [0.3, 1.0, 2.0] {
            let exact = exponential(&(&a * t)) * &x0;
            for (i, exact) in exact.iter().enumerate() {
                let found = at(&response, &format!("x{i}"), t);
                prop_assert!((found - exact).abs() < 1e-5 * size, "x{i} at {t}: {found} {exact}\n{text}");
            }
        }
    }
}
