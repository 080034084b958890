//! Lyapunov equation and H2 norm.

use mops_math::complex;
use nalgebra::DMatrix;

use super::norms::check_stable;
use super::{Complex, Schur, StateSpace};

/// Returns the symmetric solution `X` of `A X + X A^T + Q = 0` for a symmetric `Q`.
///
/// Uses the Schur form of `A`, column by column. Source: R. H. Bartels, G. W. Stewart, Solution of the matrix equation
/// AX + XB = C, Communications of the ACM 15 (1972) 820-826.
///
/// # Errors
/// If two eigenvalues of `A` sum to zero, so that no unique solution exists, or if an entry is not finite.
pub fn lyapunov(a: &DMatrix<f64>, q: &DMatrix<f64>) -> Result<DMatrix<f64>, String> {
    let n = a.nrows();
    let Schur { q: u, t } = Schur::of(a)?;
    // T Y + Y T^H + F = 0, solved from the last column to the first.
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
            if complex::norm(divisor) <= f64::EPSILON * (complex::norm(t[(i, i)]) + complex::norm(t[(j, j)])) {
                return Err("the Lyapunov equation has no unique solution: two poles sum to zero".to_owned());
            }
            y[(i, j)] = sum / divisor;
        }
    }
    let x = (&u * y * u.adjoint()).map(|z| z.re);
    Ok((&x + x.transpose()) * 0.5)
}

/// Relative difference of the two Gramian results from which on the H2 norm is rejected.
const DIFFERENT: f64 = 1e-6;

/// Returns the H2 norm, `sqrt(1/(2 pi) integral |G(j w)|_F^2 dw)`; of a system sampled with the period T,
/// `sqrt(T/(2 pi) integral
/// |G(e^(j w T))|_F^2 dw)` up to half of the sampling frequency.
///
/// The H2 norm is the root mean square of the outputs for white noise of unit intensity at the inputs, or for
/// independent samples of unit variance. The delay has no influence. Both the controllability and the observability
/// Gramian are used, as a check.
///
/// Source: K. Zhou, J. C. Doyle, Essentials of Robust Control (1998), section 4.3; for sampled systems section 21.5.
///
/// # Errors
/// If the system is not stable, or is continuous and has direct feedthrough: the norm is infinite. If the results from
/// the two Gramians differ.
pub fn h2_norm(system: &StateSpace) -> Result<f64, String> {
    check_stable(system, "H2 norm")?;
    if let Some(period) = system.period {
        // With w = 2/T tan(omega T/2), d omega is dw/(1 + (w T/2)^2): the norm of G(w)/(1 + w T/2) as a continuous
        // system.
        let image = StateSpace { period: None, ..system.clone() };
        let (m, rate) = (system.outputs.len(), 2.0 / period);
        let one = DMatrix::<f64>::identity(m, m);
        let lags = StateSpace::new(&one * -rate, &one * rate, one, DMatrix::zeros(m, m));
        return Ok(period.sqrt() * h2_norm(&image.series(&lags))?);
    }
    if system.d.iter().any(|&d| d != 0.0) {
        return Err("the system has direct feedthrough (D is not 0): its H2 norm is infinite".to_owned());
    }
    let StateSpace { a, b, c, .. } = system.balanced();
    let controllability = lyapunov(&a, &(&b * b.transpose()))?;
    let observability = lyapunov(&a.transpose(), &(c.transpose() * &c))?;
    let norm = |square: f64| square.max(0.0).sqrt();
    let first = norm((&c * controllability * c.transpose()).trace());
    let second = norm((b.transpose() * observability * &b).trace());
    if (first - second).abs() > DIFFERENT * first.max(second) {
        return Err(format!(
            "the H2 norm is inaccurate: the controllability Gramian gives {first:.6e}, the observability Gramian {second:.6e}"
        ));
    }
    Ok(first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TransferFunction;
    use crate::testing::{assert_near, random};

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
        assert!(norm(&[1.0, 1.0], &[1.0, 2.0]).unwrap_err().contains("feedthrough"));
    }

    #[test]
    fn units_of_the_states_change_no_norm_and_a_pole_that_rounding_decides_on_has_none() {
        // w^2/(s^2 + 2 z w s + w^2), with states whose units differ by a factor of 1e9.
        let (z, w) = (0.1, 5.0f64);
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1e9, -w * w * 1e-9, -2.0 * z * w]);
        let (b, c) =
            (DMatrix::from_column_slice(2, 1, &[0.0, w * w * 1e-9]), DMatrix::from_row_slice(1, 2, &[1.0, 0.0]));
        let system = StateSpace::new(a, b, c, DMatrix::zeros(1, 1));
        assert_near(h2_norm(&system).unwrap(), (w / (4.0 * z)).sqrt(), 1e-12);
        // Two free masses in coordinates that hide the drift: the double pole at 0 is computed as a small nonzero one.
        let hidden = DMatrix::from_row_slice(2, 2, &[0.3, -0.1, 0.9, -0.3 - 1e-16]);
        let drifting = StateSpace { a: hidden, ..system };
        assert!(h2_norm(&drifting).is_err());
    }

    #[test]
    fn the_norm_of_a_sampled_lag_is_that_of_its_impulse_response() {
        // y[k+1] = a y[k] + b u[k]: the sum of squares of b a^k is b^2/(1 - a^2); with a direct part d, d^2 more.
        for (a, b, d, period) in [(0.9f64, 0.3f64, 0.0f64, 0.01f64), (-0.5, 2.0, 1.5, 3.0)] {
            let half = 0.5 * period;
            let one = |x: f64| DMatrix::from_element(1, 1, x);
            let system = StateSpace {
                period: Some(period),
                ..StateSpace::new(
                    one((a - 1.0) / (a + 1.0) / half),
                    one(b / (a + 1.0) / half),
                    one(2.0 / (a + 1.0)),
                    one(d - b / (a + 1.0)),
                )
            };
            let exact = (b * b / (1.0 - a * a) + d * d).sqrt();
            assert_near(h2_norm(&system).unwrap() / exact, 1.0, 1e-12);
        }
    }

    #[test]
    fn an_undamped_system_has_no_unique_solution() {
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -1.0, 0.0]);
        assert!(lyapunov(&a, &DMatrix::identity(2, 2)).is_err());
    }
}
