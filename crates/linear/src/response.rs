//! Frequency response of a linear system.

use mops_math as math;
use mops_math::complex;
use nalgebra::DMatrix;

use super::sampled::on_axis;
use super::{Complex, StateSpace, eigenvalues};

/// System prepared for evaluation at many frequencies: its states are scaled to similar magnitude.
///
/// `s - A` is factored at each frequency in O(n^3). A single Hessenberg reduction would give O(n^2) per frequency. But
/// it fills zero entries with rounding errors, which soon exceed the response at high frequencies.
#[derive(Debug, Clone)]
pub struct FrequencyResponse {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
    delay: f64,
    period: Option<f64>,
}

impl StateSpace {
    /// Prepares the system for frequency responses.
    ///
    /// # Errors
    /// If an entry is not finite.
    pub fn response(&self) -> Result<FrequencyResponse, String> {
        let all = [&self.a, &self.b, &self.c, &self.d];
        if all.iter().any(|m| m.iter().any(|x| !x.is_finite())) || !self.delay.is_finite() {
            return Err("the system has an entry that is not finite".to_owned());
        }
        let Self { a, b, c, d, delay, period, .. } = self.balanced();
        Ok(FrequencyResponse { a, b, c, d, delay, period })
    }
}

/// Points of the imaginary axis, relative to the size of the poles, at which a response that is not zero everywhere is
/// not zero.
const LOOKED_AT: [f64; 3] = [0.37, 1.3, 7.1];

/// Magnitude of a response, relative to its terms, that is a rounding error.
const ROUNDING: f64 = 1e-13;

impl StateSpace {
    /// Returns the first output that no input acts on.
    ///
    /// # Errors
    /// If an entry is not finite.
    pub fn without_path(&self) -> Result<Option<usize>, String> {
        let sizes = eigenvalues(&self.a)?.into_iter().map(complex::norm).filter(|size| *size > 0.0);
        let (sum, count) = sizes.fold((0.0, 0.0), |(sum, count), size| (sum + math::ln(size), count + 1.0));
        let scale = if count > 0.0 { math::exp(sum / count) } else { 1.0 };
        let acts = |output: usize| -> Result<bool, String> {
            for input in 0..self.inputs.len() {
                let response = self.channel(input, output).response()?;
                for at in LOOKED_AT {
                    let s = Complex::new(0.0, at * scale);
                    if complex::norm(response.at(s)[(0, 0)]) > ROUNDING * response.terms(s) {
                        return Ok(true);
                    }
                }
            }
            Ok(false)
        };
        for output in 0..self.outputs.len() {
            if !acts(output)? {
                return Ok(Some(output));
            }
        }
        Ok(None)
    }
}

impl FrequencyResponse {
    /// Returns `(C (s - A)^-1 B + D) exp(-s delay)`, outputs x inputs; not finite at a pole. For a sampled system, s is
    /// the variable of the bilinear image.
    pub fn at(&self, s: Complex) -> DMatrix<Complex> {
        let rational = self.c.map(|x| Complex::new(x, 0.0)) * self.states(s) + self.d.map(|x| Complex::new(x, 0.0));
        if self.delay == 0.0 { rational } else { rational * complex::exp(-s * self.delay) }
    }

    /// Returns the sum of the magnitudes of the terms in the response from the first input to the first output. Its
    /// ratio to `|L|` shows the loss by cancellation.
    pub(super) fn terms(&self, s: Complex) -> f64 {
        let x = self.states(s);
        (0..self.a.nrows()).fold(self.d[(0, 0)].abs(), |sum, i| sum + self.c[(0, i)].abs() * complex::norm(x[(i, 0)]))
    }

    /// Returns `(s - A)^-1 B`, by Gaussian elimination with partial pivoting.
    fn states(&self, s: Complex) -> DMatrix<Complex> {
        let n = self.a.nrows();
        let mut m = self.a.map(|x| Complex::new(-x, 0.0));
        (0..n).for_each(|i| m[(i, i)] += s);
        let mut x = self.b.map(|x| Complex::new(x, 0.0));
        for k in 0..n {
            let pivot =
                (k + 1..n).fold(k, |best, i| if m[(i, k)].norm_sqr() > m[(best, k)].norm_sqr() { i } else { best });
            if pivot != k {
                m.swap_rows(k, pivot);
                x.swap_rows(k, pivot);
            }
            for i in k + 1..n {
                if m[(i, k)] == Complex::new(0.0, 0.0) {
                    continue;
                }
                let factor = m[(i, k)] / m[(k, k)];
                for j in k + 1..n {
                    let above = m[(k, j)];
                    m[(i, j)] -= factor * above;
                }
                for j in 0..x.ncols() {
                    let above = x[(k, j)];
                    x[(i, j)] -= factor * above;
                }
            }
        }
        for j in 0..x.ncols() {
            for i in (0..n).rev() {
                let sum = (i + 1..n).fold(x[(i, j)], |sum, k| sum - m[(i, k)] * x[(k, j)]);
                x[(i, j)] = sum / m[(i, i)];
            }
        }
        x
    }

    /// Returns the response at the point `j v` of the imaginary axis.
    pub(super) fn on_axis(&self, v: f64) -> DMatrix<Complex> {
        self.at(Complex::new(0.0, v))
    }

    /// Returns the response at the angular frequency `omega`, rad/s.
    pub fn at_frequency(&self, omega: f64) -> DMatrix<Complex> {
        self.on_axis(on_axis(self.period, omega))
    }

    /// Returns the response from the first input to the first output at the angular frequency `omega`, rad/s.
    pub fn scalar(&self, omega: f64) -> Complex {
        self.at_frequency(omega)[(0, 0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TransferFunction;
    use crate::testing::{c, random};

    #[test]
    fn the_response_is_that_of_the_resolvent() {
        for n in 0..=7 {
            let (a, b, cc, d) = (random(n, n, 1), random(n, 2, 2), random(3, n, 3), random(3, 2, 4));
            let system = StateSpace { delay: 0.3, ..StateSpace::new(a.clone(), b.clone(), cc.clone(), d.clone()) };
            let s = c(0.1, 1.7);
            let complex = |m: &DMatrix<f64>| m.map(|x| c(x, 0.0));
            let resolvent = (DMatrix::identity(n, n) * s - complex(&a)).try_inverse().unwrap();
            let exact = (complex(&cc) * resolvent * complex(&b) + complex(&d)) * complex::exp(-s * 0.3);
            assert!((system.response().unwrap().at(s) - exact).norm() < 1e-12, "{n}");
        }
    }

    #[test]
    fn at_high_frequencies_entries_that_are_zero_stay_zero() {
        // 1/(s + 1)^8 at 1000 rad/s: -480 dB.
        let chain =
            TransferFunction::new(vec![1.0], vec![1., 8., 28., 56., 70., 56., 28., 8., 1.]).state_space().unwrap();
        let exact = c(1.0, 1e3).powi(-8);
        assert!(complex::norm(chain.response().unwrap().scalar(1e3) / exact - 1.0) < 1e-13);
    }

    #[test]
    fn a_delay_turns_the_phase_and_leaves_the_magnitude() {
        let lag = TransferFunction::new(vec![2.0], vec![1.0, 1.0]).state_space().unwrap();
        let late = StateSpace { delay: 0.5, ..lag.clone() };
        let (g, h) = (lag.response().unwrap().scalar(3.0), late.response().unwrap().scalar(3.0));
        assert!(complex::norm(g - c(2.0, 0.0) / c(1.0, 3.0)) < 1e-15);
        assert!(complex::norm(h / g - complex::exp(c(0.0, -1.5))) < 1e-15);
    }

    #[test]
    fn an_integrator_at_frequency_zero_is_not_finite() {
        let integrator = TransferFunction::new(vec![1.0], vec![1.0, 0.0]).state_space().unwrap();
        assert!(!integrator.response().unwrap().scalar(0.0).is_finite());
    }
}
