//! Finite-impulse-response and ARX models as linear regressions.

use nalgebra::{DMatrix, DVector};

/// Orders of the model
///
/// ```text
/// y(t) + a_1 y(t - 1) + ... + a_na y(t - na) = b_1 u(t - d) + ... + b_nb u(t - d - nb + 1) + e(t)
/// ```
///
/// with `na` = `a`, `nb` = `b` and `d` = `delay`. With `a` = 0 the model is a finite impulse response.
///
/// Source: L. Ljung, System Identification, 2nd edition (1999), section 4.2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Regression {
    /// Number of past outputs.
    pub a: usize,
    /// Number of past inputs.
    pub b: usize,
    /// Delay from an input to the first output that it affects, in samples; 1 for a sampled system without feedthrough.
    pub delay: usize,
}

/// Error for a record that is too short for the orders: it needs more samples than this.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegressionTooShort(pub usize);

impl Regression {
    /// Returns the names of the parameters: `a1`, ..., `b1`, ...
    pub fn names(&self) -> Vec<String> {
        (1..=self.a).map(|i| format!("a{i}")).chain((1..=self.b).map(|i| format!("b{i}"))).collect()
    }

    /// Returns the rows `phi(t)' = (-y(t - 1), ..., u(t - d), ...)` and the outputs `y(t)`, from the first sample with
    /// a complete past.
    ///
    /// # Errors
    /// If the record has no more samples than parameters and past values together.
    pub fn rows(&self, u: &[f64], y: &[f64]) -> Result<(DMatrix<f64>, DVector<f64>), RegressionTooShort> {
        let past = self.a.max((self.b + self.delay).saturating_sub(1));
        let (n, samples) = (self.a + self.b, u.len().min(y.len()));
        if samples <= past + n {
            return Err(RegressionTooShort(past + n));
        }
        let entry = |t: usize, k: usize| if k < self.a { -y[t - 1 - k] } else { u[t - self.delay - (k - self.a)] };
        let rows = DMatrix::from_fn(samples - past, n, |i, k| entry(past + i, k));
        Ok((rows, DVector::from_column_slice(&y[past..samples])))
    }
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;
    use crate::least_squares;
    use mops_math::stream;

    #[test]
    fn parameters_of_a_second_order_system_are_found_to_rounding() {
        let mut random = stream(1, "regression");
        let u: Vec<f64> = (0..300).map(|_| random.random::<f64>() - 0.5).collect();
        let mut y = vec![0.0; 300];
        for t in 3..300 {
            y[t] = 1.5 * y[t - 1] - 0.7 * y[t - 2] + u[t - 2] + 0.5 * u[t - 3];
        }
        let (rows, target) = Regression { a: 2, b: 2, delay: 2 }.rows(&u, &y).unwrap();
        let found = least_squares(&rows, &target);
        for (found, exact) in found.parameters.iter().zip([-1.5, 0.7, 1.0, 0.5]) {
            assert!((found - exact).abs() < 1e-12, "{found} {exact}");
        }
    }

    #[test]
    fn a_step_determines_the_gain_of_an_impulse_response_and_nothing_else_in_the_long_run() {
        // y(t) = u(t - 1) + 2 u(t - 2) with constant u: only b1 + b2 is identifiable.
        let (rows, target) = Regression { a: 0, b: 2, delay: 1 }.rows(&[1.0; 50], &[3.0; 50]).unwrap();
        let found = least_squares(&rows, &target);
        assert!(found.rank == 1 && (found.parameters.iter().sum::<f64>() - 3.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn short_records_are_refused() {
        let model = Regression { a: 2, b: 3, delay: 1 };
        assert_eq!(model.rows(&[0.0; 8], &[0.0; 8]).unwrap_err(), RegressionTooShort(8));
        assert!(model.rows(&[0.0; 9], &[0.0; 9]).is_ok());
        assert_eq!(model.names(), ["a1", "a2", "b1", "b2", "b3"]);
    }
}
