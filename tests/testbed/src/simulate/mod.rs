//! Integrator: classical Runge-Kutta method of order 4 with fixed steps.
//!
//! Inputs have a zero-order hold; a step ends where a delayed input changes. Dry friction: see [`friction`].

mod friction;
mod world;

pub use world::outputs;

use crate::plant::{Plant, Setup};

/// Steps per sample of a plant with effects.
const STEPS: usize = 20;
/// Maximum number of states, of the plant and its effects.
const SIZE: usize = 16;
/// Maximum number of places, inputs and outputs.
const FEW: usize = 4;
/// Maximum number of parameters.
const MANY: usize = 8;

/// States of the plant, then those of its effects.
type State = [f64; SIZE];

/// Returns the noise-free outputs of the baseline model, by output and sample, with `steps` integration steps per
/// sample; `None` if it diverges.
pub fn base_outputs(plant: &Plant, p: &[f64], start: &[f64], setup: &Setup, steps: usize) -> Option<Vec<Vec<f64>>> {
    let outputs: Vec<usize> = plant.outputs.iter().map(|output| output.state).collect();
    base_states(plant, p, start, setup, (steps, &outputs))
}

/// Returns selected states of the baseline model, by state and sample; `None` if it diverges.
pub fn base_states(
    plant: &Plant,
    p: &[f64],
    start: &[f64],
    setup: &Setup,
    (steps, states): (usize, &[usize]),
) -> Option<Vec<Vec<f64>>> {
    let n = plant.states.len();
    let h = setup.dt / steps as f64;
    let w = [0.0; FEW];
    let mut x = [0.0; SIZE];
    x[..n].copy_from_slice(start);
    let mut out: Vec<Vec<f64>> = states.iter().map(|_| Vec::with_capacity(setup.samples)).collect();
    let mut u = [0.0; FEW];
    let inputs = plant.inputs.len();
    for k in 0..setup.samples {
        for (y, &state) in out.iter_mut().zip(states) {
            y.push(x[state]);
        }
        if k + 1 == setup.samples {
            break;
        }
        for i in 0..inputs {
            u[i] = setup.inputs[i][k];
        }
        let mut pending = sample(plant, k, &x, &u, p);
        for step in 0..steps {
            if let Some((_, memory)) = pending.take_if(|(delay, _)| step as f64 + 0.5 > *delay * steps as f64) {
                x[plant.continuous()..n].copy_from_slice(&memory);
            }
            x = runge_kutta(&x, n, h, |_, x, dx| (plant.rates)(&x[..n], &u, p, &w, dx));
        }
        if !x[..n].iter().all(|v| v.abs() < 1e9) {
            return None;
        }
    }
    Some(out)
}

/// Returns the values that the controller of a plant computes at a sample, and the fraction of the sample after which
/// they reach its memory; `None` if it does not sample there.
fn sample(plant: &Plant, k: usize, x: &State, u: &[f64; FEW], p: &[f64]) -> Option<(f64, Vec<f64>)> {
    let sampled = plant.traits.sampled.filter(|sampled| k.is_multiple_of(sampled.every))?;
    let mut memory = vec![0.0; sampled.memory];
    (sampled.next)(&x[..plant.states.len()], u, p, &[], &mut memory);
    Some((sampled.delay, memory))
}

/// Does one step of the classical method of order 4 for `n` states; `rates(fraction, x, dx)`.
fn runge_kutta(x: &State, n: usize, h: f64, rates: impl Fn(f64, &State, &mut [f64])) -> State {
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
