//! Transfer functions, and their conversion to state space and back.

use nalgebra::DMatrix;

use super::{Complex, StateSpace, eigenvalues, zeros};

/// Rational transfer function with a delay, `numerator(s)/denominator(s) exp(-s delay)`.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferFunction {
    /// Numerator coefficients, descending powers of s.
    pub numerator: Vec<f64>,
    /// Denominator coefficients, descending powers of s.
    pub denominator: Vec<f64>,
    /// Delay, s.
    pub delay: f64,
}

impl TransferFunction {
    /// Creates a transfer function without delay from coefficients of descending powers of s.
    pub fn new(numerator: Vec<f64>, denominator: Vec<f64>) -> Self {
        Self { numerator, denominator, delay: 0.0 }
    }

    /// Returns the system in controllable canonical form, with states `x1` (last in the chain of integrators), `x2`,
    /// ....
    ///
    /// # Errors
    /// If the denominator is zero, or if the numerator is of higher order.
    pub fn state_space(&self) -> Result<StateSpace, String> {
        let denominator = without_leading_zeros(&self.denominator);
        let numerator = without_leading_zeros(&self.numerator);
        let Some(&leading) = denominator.first() else {
            return Err("the denominator of the transfer function is 0".to_owned());
        };
        let n = denominator.len() - 1;
        if numerator.len() > n + 1 {
            return Err(format!(
                "the transfer function is improper: the numerator has order {}, the denominator order {n}",
                numerator.len() - 1
            ));
        }
        // Ascending powers, padded with zeros.
        let coefficient = |list: &[f64], power: usize| {
            if power < list.len() { list[list.len() - 1 - power] / leading } else { 0.0 }
        };
        let direct = coefficient(numerator, n);
        let mut a = DMatrix::zeros(n, n);
        let mut b = DMatrix::zeros(n, 1);
        let mut c = DMatrix::zeros(1, n);
        for i in 0..n {
            if i + 1 < n {
                a[(i, i + 1)] = 1.0;
            }
            a[(n - 1, i)] = -coefficient(denominator, i);
            c[(0, i)] = coefficient(numerator, i) - direct * coefficient(denominator, i);
        }
        if n > 0 {
            b[(n - 1, 0)] = 1.0;
        }
        let system = StateSpace::new(a, b, c, DMatrix::from_element(1, 1, direct));
        Ok(StateSpace { delay: self.delay, ..system })
    }

    /// Returns the transfer function of a system with one input and one output.
    ///
    /// Uncontrollable and unobservable poles also appear among the zeros and are not cancelled.
    ///
    /// # Errors
    /// If there are several inputs or outputs, or if an entry is not finite.
    pub fn of(system: &StateSpace) -> Result<Self, String> {
        if system.inputs.len() != 1 || system.outputs.len() != 1 {
            return Err("a transfer function has one input and one output".to_owned());
        }
        let poles = eigenvalues(&system.a)?;
        let zeros = zeros(system)?;
        let gain = gain(system, poles.len() - zeros.len());
        let numerator = if gain == 0.0 { vec![0.0] } else { polynomial(&zeros).iter().map(|c| gain * c).collect() };
        Ok(Self { numerator, denominator: polynomial(&poles), delay: system.delay })
    }
}

/// Returns the first nonzero Markov parameter, given the excess of poles over zeros.
fn gain(system: &StateSpace, excess: usize) -> f64 {
    if excess == 0 {
        return system.d[(0, 0)];
    }
    let mut x = system.b.clone();
    for _ in 1..excess {
        x = &system.a * x;
    }
    (&system.c * x)[(0, 0)]
}

/// Returns the coefficients, descending powers, of the real polynomial with these roots, which come in conjugate pairs.
pub(super) fn polynomial(roots: &[Complex]) -> Vec<f64> {
    let mut coefficients = vec![Complex::new(1.0, 0.0)];
    for root in roots {
        coefficients.push(Complex::new(0.0, 0.0));
        for i in (1..coefficients.len()).rev() {
            let before = coefficients[i - 1];
            coefficients[i] -= root * before;
        }
    }
    coefficients.iter().map(|c| c.re).collect()
}

fn without_leading_zeros(coefficients: &[f64]) -> &[f64] {
    let first = coefficients.iter().position(|&c| c != 0.0).unwrap_or(coefficients.len());
    &coefficients[first..]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{assert_near, c};
    use mops_math::complex;

    #[test]
    fn a_transfer_function_survives_the_way_to_a_state_space_and_back() {
        for (numerator, denominator) in [
            (vec![3.0, 6.0], vec![1.0, 5.0, 4.0, 0.0]),
            (vec![1.0], vec![1.0, 0.2, 1.0]),
            (vec![2.0, 1.0, 3.0], vec![1.0, 7.0, 5.0]),
            (vec![5.0], vec![1.0]),
        ] {
            let there = TransferFunction::new(numerator.clone(), denominator.clone()).state_space().unwrap();
            let back = TransferFunction::of(&there).unwrap();
            assert_eq!(back.numerator.len(), numerator.len(), "{back:?}");
            for (found, expected) in
                back.numerator.iter().chain(&back.denominator).zip(numerator.iter().chain(&denominator))
            {
                assert_near(*found, *expected, 1e-12);
            }
        }
    }

    #[test]
    fn the_state_space_has_the_response_of_the_quotient() {
        let g = TransferFunction { delay: 0.1, ..TransferFunction::new(vec![2.0, 1.0, 3.0], vec![4.0, 7.0, 5.0]) };
        let s = c(0.0, 1.3);
        let exact = (s * s * 2.0 + s + 3.0) / (s * s * 4.0 + s * 7.0 + 5.0) * complex::exp(-s * 0.1);
        assert!(complex::norm(g.state_space().unwrap().response().unwrap().at(s)[(0, 0)] - exact) < 1e-14);
    }

    #[test]
    fn what_is_no_system_is_refused() {
        assert!(TransferFunction::new(vec![1.0, 0.0], vec![1.0]).state_space().unwrap_err().contains("improper"));
        assert!(TransferFunction::new(vec![1.0], vec![0.0]).state_space().unwrap_err().contains("is 0"));
        assert!(TransferFunction::new(vec![0.0, 0.0, 1.0], vec![1.0, 2.0]).state_space().is_ok());
    }
}
