//! Integrator: classical Runge-Kutta method of order 4 with fixed steps.
//!
//! Inputs have a zero-order hold; a step ends where a delayed input changes. Dry friction: see [`friction`].

mod friction;
mod step;
mod world;

pub use world::outputs;

use crate::plant::{Plant, Setup};
use step::{FEW, SIZE, runge_kutta, sample};

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
