//! One step of the simulation.

use crate::plant::Plant;

/// Steps per sample of a plant with effects.
pub(super) const STEPS: usize = 20;

/// Maximum number of states, of the plant and its effects.
pub(super) const SIZE: usize = 16;

/// Maximum number of places, inputs and outputs.
pub(super) const FEW: usize = 4;

/// Maximum number of parameters.
pub(super) const MANY: usize = 8;

/// States of the plant, then those of its effects.
pub(super) type State = [f64; SIZE];

/// Returns the values that the controller of a plant computes at a sample, and the fraction of the sample after which
/// they reach its memory; `None` if it does not sample there.
pub(super) fn sample(plant: &Plant, k: usize, x: &State, u: &[f64; FEW], p: &[f64]) -> Option<(f64, Vec<f64>)> {
    let sampled = plant.traits.sampled.filter(|sampled| k.is_multiple_of(sampled.every))?;
    let mut memory = vec![0.0; sampled.memory];
    (sampled.next)(&x[..plant.states.len()], u, p, &[], &mut memory);
    Some((sampled.delay, memory))
}

/// Does one step of the classical method of order 4 for `n` states; `rates(fraction, x, dx)`.
pub(super) fn runge_kutta(x: &State, n: usize, h: f64, rates: impl Fn(f64, &State, &mut [f64])) -> State {
    let (mut k1, mut k2, mut k3, mut k4) = ([0.0; SIZE], [0.0; SIZE], [0.0; SIZE], [0.0; SIZE]);
    let ahead = |k: &State, c: f64| {
        let mut y = *x;
        for i in 0..n {
            y[i] += c * h * k[i];
        }
        y
    };
    rates(0.0, x, &mut k1);
    rates(0.5, &ahead(&k1, 0.5), &mut k2);
    rates(0.5, &ahead(&k2, 0.5), &mut k3);
    rates(1.0, &ahead(&k3, 1.0), &mut k4);
    let mut y = *x;
    for i in 0..n {
        y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    }
    y
}
