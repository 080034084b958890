//! The algebraic Riccati equation, and linear-quadratic state feedback.

use nalgebra::DMatrix;

use super::{Complex, Schur, eigenvalues, lyapunov};

/// The stabilising solution `X` of `A^T X + X A - X B R^-1 B^T X + Q = 0`.
///
/// From the stable invariant subspace of the Hamiltonian matrix, then refined by steps of Newton's method. Source: A. J.
/// Laub, A Schur method for solving algebraic Riccati equations, IEEE Transactions on Automatic Control 24 (1979) 913-921;
/// D. L. Kleinman, On an iterative technique for Riccati equation computations, ibid. 13 (1968) 114-115.
///
/// # Errors
/// Weights that are not what they must be; a mode that cannot be stabilised, or that lies on the imaginary axis and is not
/// weighted.
pub fn riccati(a: &DMatrix<f64>, b: &DMatrix<f64>, q: &DMatrix<f64>, r: &DMatrix<f64>) -> Result<DMatrix<f64>, String> {
    let n = a.nrows();
    if n == 0 {
        return Ok(DMatrix::zeros(0, 0));
    }
    let symmetric = |m: &DMatrix<f64>| (m - m.transpose()).norm() <= 1e-12 * m.norm();
    if !symmetric(q) || !symmetric(r) {
        return Err("the weights of states and inputs must be symmetric".to_owned());
    }
    let inverse = r.clone().cholesky().ok_or("the weights of the inputs must be positive definite")?.inverse();
    let least = q.clone().symmetric_eigenvalues().min();
    if least < -1e-12 * q.norm() {
        return Err("the weights of the states must not be negative".to_owned());
    }
    let g = b * &inverse * b.transpose();
    // X = s X': both off-diagonal blocks get the same size.
    let scale = if g.norm() > 0.0 && q.norm() > 0.0 { (q.norm() / g.norm()).sqrt() } else { 1.0 };
    let mut hamiltonian = DMatrix::zeros(2 * n, 2 * n);
    hamiltonian.view_mut((0, 0), (n, n)).copy_from(a);
    hamiltonian.view_mut((0, n), (n, n)).copy_from(&(-&g * scale));
    hamiltonian.view_mut((n, 0), (n, n)).copy_from(&(-q / scale));
    hamiltonian.view_mut((n, n), (n, n)).copy_from(&-a.transpose());
    let mut schur = Schur::of(&hamiltonian)?;
    let no_solution = || {
        "the Riccati equation has no stabilising solution: a mode cannot be stabilised, or rests on the imaginary axis \
         without weight"
            .to_owned()
    };
    if schur.reorder(|z| z.re < 0.0) != n {
        return Err(no_solution());
    }
    let upper = schur.q.view((0, 0), (n, n)).into_owned();
    let lower = schur.q.view((n, 0), (n, n)).into_owned();
    let solved = upper.adjoint().lu().solve(&lower.adjoint()).ok_or_else(no_solution)?;
    let x: DMatrix<Complex> = solved.adjoint();
    let mut x = x.map(|z| z.re * scale);
    x = (&x + x.transpose()) * 0.5;
    for _ in 0..3 {
        let closed = a - &g * &x;
        if !eigenvalues(&closed)?.iter().all(|z| z.re < 0.0) {
            return Err(no_solution());
        }
        // Newton's step: the next X satisfies a Lyapunov equation.
        x = lyapunov(&closed.transpose(), &(q + &x * &g * &x))?;
    }
    Ok(x)
}

/// The feedback `u = -K x` that minimises `integral (x^T Q x + u^T R u) dt`.
///
/// Source: B. D. O. Anderson, J. B. Moore, Optimal Control: Linear Quadratic Methods (1990), chapter 3.
///
/// # Errors
/// As [`riccati`].
pub fn lqr(a: &DMatrix<f64>, b: &DMatrix<f64>, q: &DMatrix<f64>, r: &DMatrix<f64>) -> Result<DMatrix<f64>, String> {
    let x = riccati(a, b, q, r)?;
    let factor = r.clone().cholesky().expect("checked with the equation");
    Ok(factor.solve(&(b.transpose() * x)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::testing::{assert_near, furuta, random};

    #[test]
    fn the_scalar_equation_has_its_closed_form() {
        // 2 a x - b^2 x^2/r + q = 0.
        let one = |x: f64| DMatrix::from_element(1, 1, x);
        let (a, b, q, r) = (0.7, 2.0, 3.0, 0.5);
        let exact = r / (b * b) * (a + f64::sqrt(a * a + b * b * q / r));
        assert_near(riccati(&one(a), &one(b), &one(q), &one(r)).unwrap()[(0, 0)], exact, 1e-14);
    }

    #[test]
    fn the_double_integrator_has_its_closed_form() {
        // Q = diag(1, 0), R = 1: K = (1, sqrt 2).
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 0.0, 0.0]);
        let b = DMatrix::from_row_slice(2, 1, &[0.0, 1.0]);
        let q = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.0]);
        let k = lqr(&a, &b, &q, &DMatrix::identity(1, 1)).unwrap();
        assert_near(k[(0, 0)], 1.0, 1e-13);
        assert_near(k[(0, 1)], 2.0f64.sqrt(), 1e-13);
    }

    #[test]
    fn the_solution_satisfies_the_equation_and_stabilises() {
        for n in 1..=8 {
            let (a, b) = (random(n, n, 11), random(n, 2, 12));
            let (q, r) = (DMatrix::identity(n, n), DMatrix::identity(2, 2) * 0.3);
            let x = riccati(&a, &b, &q, &r).unwrap();
            let residual = a.transpose() * &x + &x * &a - &x * &b * b.transpose() * &x / 0.3 + &q;
            assert!(residual.norm() < 1e-11 * x.norm(), "{n}: {}", residual.norm());
            let k = lqr(&a, &b, &q, &r).unwrap();
            assert!(eigenvalues(&(&a - &b * k)).unwrap().iter().all(|z| z.re < 0.0));
        }
    }

    #[test]
    fn the_pendulum_is_stabilised_with_the_gain_of_another_implementation() {
        let (a, b) = furuta();
        let q = DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![1.0, 0.1, 10.0, 0.1]));
        let k = lqr(&a, &b, &q, &DMatrix::from_element(1, 1, 1000.0)).unwrap();
        for (found, expected) in k.iter().zip(LQR) {
            assert_near(*found, expected, 1e-10 * expected.abs());
        }
    }

    /// SciPy 1.17.1, `solve_continuous_are`.
    const LQR: [f64; 4] = [-0.031_698_284_615, -0.025_227_862_966_5, -0.385_122_190_968, -0.067_332_515_286_4];

    #[test]
    fn a_mode_that_no_input_reaches_must_be_stable() {
        let a = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, -1.0]);
        let b = DMatrix::from_row_slice(2, 1, &[0.0, 1.0]);
        let one = DMatrix::identity(1, 1);
        assert!(riccati(&a, &b, &DMatrix::identity(2, 2), &one).unwrap_err().contains("no stabilising solution"));
        assert!(riccati(&a, &b, &DMatrix::identity(2, 2), &-&one).unwrap_err().contains("positive definite"));
        let resting = DMatrix::from_row_slice(2, 2, &[0.0, 0.0, 0.0, -1.0]);
        assert!(riccati(&resting, &b, &DMatrix::identity(2, 2), &one).is_err());
    }
}
