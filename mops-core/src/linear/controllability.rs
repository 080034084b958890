//! Whether inputs can move every mode.

use nalgebra::DMatrix;

use super::eigen::balance;
use super::{Complex, eigenvalues};

/// Smallest singular value of `[A - s, B]`, relative to its largest, that still counts as controllable.
const SMALL: f64 = 1e-12;

/// Checks that inputs can move every mode: `[A - s, B]` has full rank at every eigenvalue s of `A`.
///
/// Source (Popov, Belevitch, Hautus): T. Kailath, Linear Systems (1980), section 2.4.3.
///
/// # Errors
/// The modes that no input moves, in one sentence.
pub fn check_controllable(a: &DMatrix<f64>, b: &DMatrix<f64>) -> Result<(), String> {
    let mut balanced = a.clone();
    let scales = balance(&mut balanced);
    let mut inputs = b.clone();
    for (i, scale) in scales.into_iter().enumerate() {
        inputs.row_mut(i).unscale_mut(scale);
    }
    let size = if balanced.norm() > 0.0 { balanced.norm() } else { 1.0 };
    for mut column in inputs.column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column *= size / norm;
        }
    }
    let mut fixed: Vec<String> = Vec::new();
    for mode in eigenvalues(a)?.into_iter().filter(|mode| mode.im >= 0.0) {
        let n = a.nrows();
        let mut m = DMatrix::<Complex>::zeros(n, n + b.ncols());
        m.columns_mut(0, n).copy_from(&balanced.map(|x| Complex::new(x, 0.0)));
        m.columns_mut(n, b.ncols()).copy_from(&inputs.map(|x| Complex::new(x, 0.0)));
        (0..n).for_each(|i| m[(i, i)] -= mode);
        let values = m.singular_values();
        if values.min() <= SMALL * values.max() {
            fixed.push(match mode.im {
                0.0 => format!("{:.6}", mode.re),
                im => format!("{:.6} +- {im:.6}i", mode.re),
            });
        }
    }
    fixed.dedup();
    if fixed.is_empty() {
        return Ok(());
    }
    Err(format!("the system is not controllable: no input moves the mode at {} 1/s", fixed.join(" and at ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::testing::{furuta, random};

    #[test]
    fn the_mode_that_no_input_moves_is_named() {
        let a = DMatrix::from_row_slice(3, 3, &[-1.0, 2.0, 0.0, 0.0, -3.0, 0.0, 4.0, 5.0, -6.0]);
        let b = DMatrix::from_row_slice(3, 1, &[1.0, 0.0, 0.0]);
        let fact = check_controllable(&a, &b).unwrap_err();
        assert_eq!(fact, "the system is not controllable: no input moves the mode at -3.000000 1/s");
    }

    #[test]
    fn the_pendulum_and_a_random_system_are_controllable() {
        let (a, b) = furuta();
        assert_eq!(check_controllable(&a, &b), Ok(()));
        assert_eq!(check_controllable(&random(9, 9, 1), &random(9, 1, 2)), Ok(()));
        assert!(check_controllable(&DMatrix::identity(2, 2), &random(2, 1, 3)).is_err(), "one input, a double mode");
    }
}
