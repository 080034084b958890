//! The frequency response of a linear system.

use nalgebra::DMatrix;

use super::eigen::balance;
use super::{Complex, StateSpace};

/// A system made ready to be evaluated at many frequencies: `A` in Hessenberg form, so that each takes O(n^2) operations.
///
/// Source: A. J. Laub, Efficient multivariable frequency response computations, IEEE Transactions on Automatic Control 26
/// (1981) 407-408.
#[derive(Debug, Clone)]
pub struct FrequencyResponse {
    h: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
    delay: f64,
}

impl StateSpace {
    /// The system made ready for frequency responses.
    ///
    /// # Errors
    /// An entry that is not finite.
    pub fn response(&self) -> Result<FrequencyResponse, String> {
        let all = [&self.a, &self.b, &self.c, &self.d];
        if all.iter().any(|m| m.iter().any(|x| !x.is_finite())) || !self.delay.is_finite() {
            return Err("the system has an entry that is not finite".to_owned());
        }
        let (mut h, mut b, mut c) = (self.a.clone(), self.b.clone(), self.c.clone());
        for (i, scale) in balance(&mut h).into_iter().enumerate() {
            b.row_mut(i).unscale_mut(scale);
            c.column_mut(i).scale_mut(scale);
        }
        if h.nrows() > 2 {
            let (q, hessenberg) = h.hessenberg().unpack();
            (h, b, c) = (hessenberg, q.transpose() * b, c * q);
        }
        Ok(FrequencyResponse { h, b, c, d: self.d.clone(), delay: self.delay })
    }
}

impl FrequencyResponse {
    /// `(C (s - A)^-1 B + D) exp(-s delay)`, outputs x inputs; not finite at a pole.
    pub fn at(&self, s: Complex) -> DMatrix<Complex> {
        let n = self.h.nrows();
        let mut m = self.h.map(|x| Complex::new(-x, 0.0));
        (0..n).for_each(|i| m[(i, i)] += s);
        let mut x = self.b.map(|x| Complex::new(x, 0.0));
        // Gaussian elimination with exchange of neighbouring rows: only the subdiagonal is to be removed.
        for k in 1..n {
            if m[(k, k - 1)].norm() > m[(k - 1, k - 1)].norm() {
                m.swap_rows(k - 1, k);
                x.swap_rows(k - 1, k);
            }
            if m[(k, k - 1)].norm() == 0.0 {
                continue;
            }
            let factor = m[(k, k - 1)] / m[(k - 1, k - 1)];
            for j in k..n {
                let above = m[(k - 1, j)];
                m[(k, j)] -= factor * above;
            }
            for j in 0..x.ncols() {
                let above = x[(k - 1, j)];
                x[(k, j)] -= factor * above;
            }
        }
        for j in 0..x.ncols() {
            for i in (0..n).rev() {
                let sum = (i + 1..n).fold(x[(i, j)], |sum, k| sum - m[(i, k)] * x[(k, j)]);
                x[(i, j)] = sum / m[(i, i)];
            }
        }
        let rational = self.c.map(|x| Complex::new(x, 0.0)) * x + self.d.map(|x| Complex::new(x, 0.0));
        if self.delay == 0.0 { rational } else { rational * (-s * self.delay).exp() }
    }

    /// The response at the angular frequency `omega`, rad/s.
    pub fn at_frequency(&self, omega: f64) -> DMatrix<Complex> {
        self.at(Complex::new(0.0, omega))
    }

    /// The response of the first input and output at the angular frequency `omega`, rad/s.
    pub fn scalar(&self, omega: f64) -> Complex {
        self.at_frequency(omega)[(0, 0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::TransferFunction;
    use crate::linear::testing::{c, random};

    #[test]
    fn the_response_is_that_of_the_resolvent() {
        for n in 0..=7 {
            let (a, b, cc, d) = (random(n, n, 1), random(n, 2, 2), random(3, n, 3), random(3, 2, 4));
            let system = StateSpace { delay: 0.3, ..StateSpace::new(a.clone(), b.clone(), cc.clone(), d.clone()) };
            let s = c(0.1, 1.7);
            let complex = |m: &DMatrix<f64>| m.map(|x| c(x, 0.0));
            let resolvent = (DMatrix::identity(n, n) * s - complex(&a)).try_inverse().unwrap();
            let exact = (complex(&cc) * resolvent * complex(&b) + complex(&d)) * (-s * 0.3).exp();
            assert!((system.response().unwrap().at(s) - exact).norm() < 1e-12, "{n}");
        }
    }

    #[test]
    fn a_delay_turns_the_phase_and_leaves_the_magnitude() {
        let lag = TransferFunction::new(vec![2.0], vec![1.0, 1.0]).state_space().unwrap();
        let late = StateSpace { delay: 0.5, ..lag.clone() };
        let (g, h) = (lag.response().unwrap().scalar(3.0), late.response().unwrap().scalar(3.0));
        assert!((g - c(2.0, 0.0) / c(1.0, 3.0)).norm() < 1e-15);
        assert!((h / g - c(0.0, -1.5).exp()).norm() < 1e-15);
    }

    #[test]
    fn an_integrator_at_frequency_zero_is_not_finite() {
        let integrator = TransferFunction::new(vec![1.0], vec![1.0, 0.0]).state_space().unwrap();
        assert!(!integrator.response().unwrap().scalar(0.0).is_finite());
    }
}
