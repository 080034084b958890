//! Algebraic Riccati equation and linear-quadratic state feedback.

use nalgebra::DMatrix;

use super::controllability::Scaled;
use super::{Complex, Schur, eigenvalues, lyapunov, undecided};

/// Relative residual up to which a Riccati equation counts as solved.
const SOLVED: f64 = 1e-8;

/// Part of the norm of the scaled matrix by which a mode without weight, or without input, may lie off the imaginary
/// axis: the errors of its separation from the others. The Hamiltonian matrix has a double eigenvalue there, which
/// rounding moves by the square root, and a multiple one by higher roots, to either side.
const UNDECIDED: f64 = 1e-12;

/// Maximum number of Newton steps. Each doubles the number of correct digits, so further steps bring no gain.
const STEPS: usize = 20;

/// Returns the stabilising solution `X` of `A^T X + X A - X B R^-1 B^T X + Q = 0`.
///
/// The solution comes from the stable invariant subspace of the Hamiltonian matrix, in scaled units, and is refined by
/// Newton's method. The residual and the stability of `A - B R^-1 B^T X` are checked.
///
/// Source: A. J. Laub, A Schur method for solving algebraic Riccati equations, IEEE Transactions on Automatic Control
/// 24 (1979) 913-921; D. L. Kleinman, On an iterative technique for Riccati equation computations, ibid. 13 (1968)
/// 114-115.
///
/// # Errors
/// If a weight is not symmetric, `R` is not positive definite or `Q` is not positive semidefinite. If a mode is not
/// stabilisable, or lies on the imaginary axis and has no weight. If the residual stays large.
pub fn riccati(a: &DMatrix<f64>, b: &DMatrix<f64>, q: &DMatrix<f64>, r: &DMatrix<f64>) -> Result<DMatrix<f64>, String> {
    if a.nrows() == 0 {
        return Ok(DMatrix::zeros(0, 0));
    }
    let symmetric = |m: &DMatrix<f64>| (m - m.transpose()).norm() <= 1e-12 * m.norm();
    if !symmetric(q) || !symmetric(r) {
        return Err("the weights of states and inputs must be symmetric".to_owned());
    }
    let inverse = r.clone().cholesky().ok_or("the weights of the inputs must be positive definite")?.inverse();
    let least = q.clone().symmetric_eigenvalues().min();
    if least < -1e-12 * q.norm() {
        return Err("the weights of the states must be positive semidefinite".to_owned());
    }
    let scaled = Scaled::of(a, b);
    let weighted = Scaled::of(&a.transpose(), q);
    let size = |scaled: &Scaled| UNDECIDED * scaled.a.norm();
    if scaled.leaves_unstable(size(&scaled))? || weighted.leaves_undamped(size(&weighted))? {
        return Err(no_solution());
    }
    // In the scaled system B R^-1 B^T is D^-1 (B R^-1 B^T) D^-1, and Q is D Q D.
    let equation =
        Equation { g: scaled.per_states(&(b * inverse * b.transpose())), q: scaled.by_states(q), a: scaled.a.clone() };
    let x = equation.solution()?;
    Ok(scaled.per_states(&x))
}

/// The equation `A^T X + X A - X G X + Q = 0`.
struct Equation {
    a: DMatrix<f64>,
    g: DMatrix<f64>,
    q: DMatrix<f64>,
}

impl Equation {
    fn solution(&self) -> Result<DMatrix<f64>, String> {
        let mut x = self.by_subspace()?;
        let mut residual = f64::INFINITY;
        for _ in 0..STEPS {
            let closed = &self.a - &self.g * &x;
            if !eigenvalues(&closed)?.iter().all(|z| z.re < 0.0) {
                return Err(no_solution());
            }
            // Newton step: the next X satisfies a Lyapunov equation.
            let next = lyapunov(&closed.transpose(), &(&self.q + &x * &self.g * &x))?;
            let left = self.residual(&next);
            if left.is_nan() || left >= 0.5 * residual {
                break;
            }
            (x, residual) = (next, left);
        }
        if residual.is_nan() || residual > SOLVED {
            return Err(format!(
                "the Riccati equation was not solved: relative residual {residual:.1e}; choose weights that are closer in \
                 magnitude"
            ));
        }
        let closed = &self.a - &self.g * &x;
        if eigenvalues(&closed)?.iter().all(|z| z.re < 0.0) && undecided(&closed)?.is_empty() {
            Ok(x)
        } else {
            Err(no_solution())
        }
    }

    /// Returns the solution from the stable invariant subspace of the Hamiltonian matrix.
    fn by_subspace(&self) -> Result<DMatrix<f64>, String> {
        let Self { a, g, q } = self;
        let n = a.nrows();
        // X = s X', so that both off-diagonal blocks have the same norm.
        let scale = if g.norm() > 0.0 && q.norm() > 0.0 { (q.norm() / g.norm()).sqrt() } else { 1.0 };
        let mut hamiltonian = DMatrix::zeros(2 * n, 2 * n);
        hamiltonian.view_mut((0, 0), (n, n)).copy_from(a);
        hamiltonian.view_mut((0, n), (n, n)).copy_from(&(-g * scale));
        hamiltonian.view_mut((n, 0), (n, n)).copy_from(&(-q / scale));
        hamiltonian.view_mut((n, n), (n, n)).copy_from(&-a.transpose());
        let mut schur = Schur::of(&hamiltonian)?;
        if schur.reorder(|z| z.re < 0.0) != n {
            return Err(no_solution());
        }
        let upper = schur.q.view((0, 0), (n, n)).into_owned();
        let lower = schur.q.view((n, 0), (n, n)).into_owned();
        let x: DMatrix<Complex> = upper.adjoint().lu().solve(&lower.adjoint()).ok_or_else(no_solution)?.adjoint();
        let x = x.map(|z| z.re * scale);
        Ok((&x + x.transpose()) * 0.5)
    }

    /// Returns the residual at `x`, relative to the sizes of the terms.
    fn residual(&self, x: &DMatrix<f64>) -> f64 {
        let (linear, square) = (self.a.transpose() * x, x * &self.g * x);
        let left = &linear + linear.transpose() - &square + &self.q;
        left.norm() / (2.0 * linear.norm() + square.norm() + self.q.norm()).max(f64::MIN_POSITIVE)
    }
}

fn no_solution() -> String {
    "the Riccati equation has no stabilising solution: a mode is not stabilisable, or lies on the imaginary axis and has no \
     weight"
        .to_owned()
}

/// Returns the gain `K` of the feedback `u = -K x` that minimises `integral (x^T Q x + u^T R u) dt`.
///
/// Source: B. D. O. Anderson, J. B. Moore, Optimal Control: Linear Quadratic Methods (1990), chapter 3.
///
/// # Errors
/// See [`riccati`].
pub fn lqr(a: &DMatrix<f64>, b: &DMatrix<f64>, q: &DMatrix<f64>, r: &DMatrix<f64>) -> Result<DMatrix<f64>, String> {
    let x = riccati(a, b, q, r)?;
    let factor = r.clone().cholesky().expect("checked with the equation");
    Ok(factor.solve(&(b.transpose() * x)))
}

#[cfg(test)]
mod tests {
    use mops_math as math;
    use proptest::prelude::*;

    use super::*;
    use crate::reference;
    use crate::testing::{assert_near, furuta, random};

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

    /// Reference values from SciPy 1.17.1, `solve_continuous_are`.
    const LQR: [f64; 4] = [-0.031_698_284_615, -0.025_227_862_966_5, -0.385_122_190_968, -0.067_332_515_286_4];

    /// Returns the elementwise relative residual, in the given units.
    fn residual(a: &DMatrix<f64>, b: &DMatrix<f64>, q: &DMatrix<f64>, r: &DMatrix<f64>, x: &DMatrix<f64>) -> f64 {
        let g = b * r.clone().try_inverse().unwrap() * b.transpose();
        let (linear, square) = (a.transpose() * x, x * g * x);
        let left = &linear + linear.transpose() - &square + q;
        let size = linear.abs() + linear.abs().transpose() + square.abs() + q.abs();
        let scale = |i: usize| size[(i, i)].max(f64::MIN_POSITIVE).sqrt();
        let n = a.nrows();
        (0..n * n).map(|k| left[(k % n, k / n)].abs() / scale(k % n) / scale(k / n)).fold(0.0, f64::max)
    }

    #[test]
    fn units_of_the_states_change_no_feedback() {
        // A motor in SI units and in units that differ by up to 1e15; the weights are converted with them.
        let a = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.0, 0.0, -0.5, 20.0, 0.0, -3.0, -400.0]);
        let b = DMatrix::from_column_slice(3, 1, &[0.0, 0.0, 250.0]);
        let (q, r) = (
            DMatrix::from_diagonal(&nalgebra::DVector::from_row_slice(&[5.0, 0.1, 1e-3])),
            DMatrix::from_element(1, 1, 0.2),
        );
        let expected = lqr(&a, &b, &q, &r).unwrap();
        for units in [[1e6, 1.0, 1e-3], [1e-9, 1e6, 1.0], [1.0, 1e-8, 1e7], [1e3, 1e3, 1e-12]] {
            let d = DMatrix::from_diagonal(&nalgebra::DVector::from_row_slice(&units));
            let inverse = d.clone().try_inverse().unwrap();
            let (a, b, q) = (&d * &a * &inverse, &d * &b, &inverse * &q * &inverse);
            let x = riccati(&a, &b, &q, &r).unwrap();
            assert!(residual(&a, &b, &q, &r, &x) < 1e-9, "{units:?}");
            let k = lqr(&a, &b, &q, &r).unwrap() * &d;
            assert!((&k - &expected).norm() < 1e-9 * expected.norm(), "{units:?}: {k} {expected}");
        }
    }

    proptest! {
        #![proptest_config(mops_tiers::property(1_000))]

        #[test]
        fn what_is_returned_solves_the_equation_and_stabilises(
            n in 1usize..8, inputs in 1usize..3, seed in 0u64..1_000_000_000, decades in -6.0f64..6.0, zeros in 0usize..3,
        ) {
            let (a, b) = (random(n, n, seed) * 3.0, random(n, inputs, seed + 1));
            let mut q = DMatrix::identity(n, n);
            (0..zeros.min(n - 1)).for_each(|i| q[(i, i)] = 0.0);
            let r = DMatrix::identity(inputs, inputs) * math::powf(10.0, decades);
            if let Ok(x) = riccati(&a, &b, &q, &r) {
                prop_assert!(residual(&a, &b, &q, &r, &x) < 1e-6, "{}", residual(&a, &b, &q, &r, &x));
                let closed = &a - &b * lqr(&a, &b, &q, &r).unwrap();
                let exact = reference::eigenvalues(&closed);
                prop_assert!(exact.iter().all(|z| z.re < 0.0), "{:?}", exact);
                prop_assert!(x.symmetric_eigenvalues().min() > -1e-9);
            } else {
                // Random systems are controllable, and observable from all states.
                prop_assert!(zeros > 0 || decades.abs() > 4.0, "{} {}", a, b);
            }
        }
    }

    /// Returns block diagonal matrices in other coordinates: states permuted and in units of up to 100, or turned.
    fn beside(mode: &DMatrix<f64>, n: usize, seed: u64) -> (DMatrix<f64>, DMatrix<f64>) {
        let m = mode.nrows();
        let (block, turn) = (random(n, n, seed), random(n + m, n + m, seed + 1));
        let mut a = DMatrix::zeros(n + m, n + m);
        a.view_mut((0, 0), (n, n)).copy_from(&block);
        a.view_mut((n, n), (m, m)).copy_from(mode);
        let to = if seed.is_multiple_of(2) {
            turn.qr().q()
        } else {
            let order: Vec<usize> = (0..n + m).map(|i| (i * 5 + 1) % (n + m)).collect();
            let unit = |i: usize| math::powf(100.0, turn[(0, i)]);
            if order.iter().collect::<std::collections::BTreeSet<_>>().len() < n + m {
                DMatrix::identity(n + m, n + m)
            } else {
                DMatrix::from_fn(n + m, n + m, |i, j| if order[i] == j { unit(i) } else { 0.0 })
            }
        };
        (a, to)
    }

    #[test]
    fn an_unweighted_mode_on_the_axis_is_refused_whatever_its_multiplicity() {
        let chain = |n: usize| DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(j == i + 1)));
        let oscillator = |w: f64| DMatrix::from_row_slice(2, 2, &[0.0, w, -w, 0.0]);
        let double = {
            let mut m = DMatrix::zeros(4, 4);
            m.view_mut((0, 0), (2, 2)).copy_from(&oscillator(2.0));
            m.view_mut((2, 2), (2, 2)).copy_from(&oscillator(2.0));
            m.view_mut((0, 2), (2, 2)).copy_from(&DMatrix::identity(2, 2));
            m
        };
        for (kind, mode) in
            [chain(1), chain(2), chain(3), chain(4), oscillator(2.0), oscillator(300.0), double].iter().enumerate()
        {
            for seed in 0..24 {
                let n = 2 + (seed % 5) as usize;
                let (a, to) = beside(mode, n, 100 * kind as u64 + seed);
                let m = mode.nrows();
                let back = to.clone().try_inverse().unwrap();
                let all = random(n + m, 1, seed + 7);
                let weights = |of_mode: f64| {
                    let q = DMatrix::from_fn(n + m, n + m, |i, j| match i == j {
                        true => {
                            if i < n {
                                1.0
                            } else {
                                of_mode
                            }
                        }
                        false => 0.0,
                    });
                    let q = back.transpose() * q * &back;
                    (&q + q.transpose()) * 0.5
                };
                let (a, b) = (&to * &a * &back, &to * &all);
                let one = DMatrix::identity(1, 1);
                assert!(riccati(&a, &b, &weights(0.0), &one).is_err(), "{kind} {seed}");
                let weighted = riccati(&a, &b, &weights(1.0), &one);
                let refused = weighted.is_err_and(|why| why.contains("no stabilising solution"));
                assert!(!refused, "{kind} {seed}: with weight");
                // The input that does not reach the mode.
                let mut part = all.clone();
                part.rows_mut(n, m).fill(0.0);
                assert!(riccati(&a, &(&to * part), &weights(1.0), &one).is_err(), "{kind} {seed}: without input");
            }
        }
    }

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
