//! The equations of a model at one point with exact slopes, so that it can be linearised there.

use mops_core::{Dual, Failure, Local, OperatingPoint, Scalar};
use nalgebra::DMatrix;

use super::Dynamics;

/// What a model written over [`Dynamics`] gives to be linearised.
pub trait Equations {
    /// The rates of the states and the values of the signals; [`rates_and_signals`] reads them from a `Dynamics` whose
    /// drives are held.
    ///
    /// # Errors
    /// Parameters for which the model is not defined.
    fn equations<S: Scalar>(&self, at: &OperatingPoint<'_, S>) -> Result<[Vec<S>; 2], Failure>;

    /// The joints whose dry friction is left out there, by the names of their positions.
    fn frictionless(&self, _at: &OperatingPoint<'_>) -> Vec<String> {
        Vec::new()
    }
}

/// Speed up to which a joint is as good as at rest, rad/s or m/s: that of a model at rest after rounding.
const STILL: f64 = 1e-9;

/// Whether a joint with this speed has no dry friction at an operating point: on both sides of speed 0 it would have other
/// signs, and in between no slope.
pub fn rests<S: Scalar>(at: &OperatingPoint<'_, S>, speed: S) -> bool {
    at.at_rest || speed.value().abs() <= STILL
}

/// The rates of the states, and the first `count` signals by their `output`, at time 0.
pub fn rates_and_signals<S: Scalar, D: Dynamics<S>>(
    dynamics: &D,
    x: &D::State,
    count: usize,
    output: &impl Fn(&D, usize, f64, &D::State) -> S,
) -> [Vec<S>; 2] {
    let mut rates = x.clone();
    dynamics.derivative(0.0, x, &mut rates);
    [rates.as_ref().to_vec(), (0..count).map(|signal| output(dynamics, signal, 0.0, x)).collect()]
}

/// Directions that are differentiated at once.
const CHUNK: usize = 8;

/// [`mops_core::Model::local`] of a model with [`Equations`].
///
/// # Errors
/// Parameters for which the model is not defined.
pub fn local(model: &impl Equations, at: &OperatingPoint<'_>) -> Result<Local, Failure> {
    let OperatingPoint { parameters, states, inputs, at_rest } = *at;
    let [rates, signals] = model.equations(at)?;
    let constants: Vec<Dual<CHUNK>> = parameters.iter().map(|&p| p.into()).collect();
    let columns = states.len() + inputs.len();
    let mut slopes = DMatrix::zeros(rates.len() + signals.len(), columns);
    for first in (0..columns).step_by(CHUNK) {
        let variable = |(j, &value): (usize, &f64)| {
            let direction = j.wrapping_sub(first);
            if direction < CHUNK { Dual::variable(value, direction) } else { Dual::from(value) }
        };
        let all: Vec<Dual<CHUNK>> = states.iter().chain(inputs).enumerate().map(variable).collect();
        let (states, inputs) = all.split_at(states.len());
        let at = OperatingPoint { parameters: &constants, states, inputs, at_rest };
        let [rates, signals] = model.equations(&at)?;
        for (i, row) in rates.iter().chain(&signals).enumerate() {
            for j in first..columns.min(first + CHUNK) {
                slopes[(i, j)] = row.tangent[j - first];
            }
        }
    }
    if slopes.iter().chain(&rates).all(|x| x.is_finite()) {
        Ok(Local { rates, signals, slopes, frictionless: model.frictionless(at) })
    } else {
        Err(Failure::Undefined("the equations have no finite slope at the operating point".into()))
    }
}
