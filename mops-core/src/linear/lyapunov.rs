//! The Lyapunov equation, and the H2 norm that follows from it.

use nalgebra::DMatrix;

use super::{Complex, Schur, StateSpace};

/// The symmetric solution `X` of `A X + X A^T + Q = 0` for a symmetric `Q`.
///
/// By the Schur form of `A`, column by column. Source: R. H. Bartels, G. W. Stewart, Solution of the matrix equation AX +
/// XB = C, Communications of the ACM 15 (1972) 820-826.
///
/// # Errors
/// Two eigenvalues of `A` that sum to zero, so that there is no unique solution; an entry that is not finite.
pub fn lyapunov(a: &DMatrix<f64>, q: &DMatrix<f64>) -> Result<DMatrix<f64>, String> {
    let n = a.nrows();
    let Schur { q: u, t } = Schur::of(a)?;
    // T Y + Y T^H + F = 0, from the last column to the first.
    let f = u.adjoint() * q.map(|x| Complex::new(x, 0.0)) * &u;
    let mut y = DMatrix::<Complex>::zeros(n, n);
    for j in (0..n).rev() {
        let mut right = -f.column(j);
        for k in j + 1..n {
            right -= y.column(k) * t[(j, k)].conj();
        }
        for i in (0..n).rev() {
            let sum = (i + 1..n).fold(right[i], |sum, k| sum - t[(i, k)] * y[(k, j)]);
            let divisor = t[(i, i)] + t[(j, j)].conj();
            if divisor.norm() <= f64::EPSILON * (t[(i, i)].norm() + t[(j, j)].norm()) {
                return Err("the Lyapunov equation has no unique solution: two poles sum to zero".to_owned());
            }
            y[(i, j)] = sum / divisor;
        }
    }
    let x = (&u * y * u.adjoint()).map(|z| z.re);
    Ok((&x + x.transpose()) * 0.5)
}

/// The H2 norm, `sqrt(1/(2 pi) integral |G(j w)|_F^2 dw)`: the root mean square of the outputs for white noise of unit
/// intensity at the inputs. The delay does not matter.
///
/// Source: K. Zhou, J. C. Doyle, Essentials of Robust Control (1998), section 4.3.
///
/// # Errors
/// A system that is not stable, or passes its input on directly: the norm is infinite.
pub fn h2_norm(system: &StateSpace) -> Result<f64, String> {
    if !system.is_stable()? {
        return Err("the system is not stable: its H2 norm is infinite".to_owned());
    }
    if system.d.iter().any(|&d| d != 0.0) {
        return Err("the system passes its input on directly (D is not 0): its H2 norm is infinite".to_owned());
    }
    let x = lyapunov(&system.a, &(&system.b * system.b.transpose()))?;
    Ok((&system.c * x * system.c.transpose()).trace().max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::TransferFunction;
    use crate::linear::testing::{assert_near, random};

    #[test]
    fn the_solution_satisfies_the_equation() {
        for n in 1..=8 {
            let a = random(n, n, 5) - DMatrix::identity(n, n) * 2.0;
            let b = random(n, 2, 6);
            let q = &b * b.transpose();
            let x = lyapunov(&a, &q).unwrap();
            assert!((&a * &x + &x * a.transpose() + q).norm() < 1e-13 * n as f64);
        }
    }

    #[test]
    fn the_h2_norm_has_its_closed_form() {
        // k/(s + p): k/sqrt(2 p). w^2/(s^2 + 2 z w s + w^2): sqrt(w/(4 z)).
        let norm = |numerator: &[f64], denominator: &[f64]| {
            h2_norm(&TransferFunction::new(numerator.to_vec(), denominator.to_vec()).state_space().unwrap())
        };
        assert_near(norm(&[3.0], &[1.0, 2.0]).unwrap(), 1.5, 1e-14);
        assert_near(norm(&[25.0], &[1.0, 2.0 * 0.1 * 5.0, 25.0]).unwrap(), (5.0f64 / 0.4).sqrt(), 1e-13);
        assert!(norm(&[1.0], &[1.0, -2.0]).unwrap_err().contains("not stable"));
        assert!(norm(&[1.0, 1.0], &[1.0, 2.0]).unwrap_err().contains("directly"));
    }

    #[test]
    fn an_undamped_system_has_no_unique_solution() {
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -1.0, 0.0]);
        assert!(lyapunov(&a, &DMatrix::identity(2, 2)).is_err());
    }
}
