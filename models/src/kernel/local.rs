//! Model equations at one point with exact derivatives, for linearisation there.

use mops_core::{
    Failure, Instant, Plant,
    model::{Local, OperatingPoint},
    plant::{LeftOut, Selected},
};
use mops_language::{DIRECTIONS, Dual, Dual7, Scalar};
use nalgebra::DMatrix;

use super::PlantModel;

/// Speed up to which a joint counts as at rest, rad/s or m/s: covers the rounding of a model at rest.
const STILL: f64 = 1e-9;

/// Returns true if dry friction is left out for a joint with this speed when the model is linearised. At speed 0
/// friction has opposite signs on both sides and no derivative in between.
pub fn rests<S: Scalar>(at_rest: bool, speed: S) -> bool {
    at_rest || speed.value().abs() <= STILL
}

/// Values of the equations at an operating point: rates of the states, or changes of memory at an instant, then the
/// signals, then the quantities whose past matters.
fn look<S: Scalar>(model: &impl PlantModel, at: &OperatingPoint<'_, S>) -> Result<(Vec<S>, LeftOut<S>), Failure> {
    let mut plant = model.plant(at.parameters)?;
    if let Some(memory) = plant.memory_mut() {
        memory.hold(at.past);
    }
    let w = vec![S::from(0.0); model.interface().forces()];
    let here = Instant { t: 0.0, x: at.states, u: at.inputs, w: &w };
    let left_out = plant.linearise(&here, at.at_rest)?;
    let mut values = at.states.to_vec();
    plant.rates(&here, &mut values);
    if let Some(breaks) = plant.breaks() {
        breaks.changes(&here, &mut values);
    }
    values.extend((0..model.interface().signals.len()).map(|signal| plant.signal(signal, &here)));
    values.extend(plant.memory().map_or_else(Vec::new, |memory| memory.past(&here)));
    Ok((values, left_out))
}

/// Linearises a model given by its plant; implements [`mops_core::Model::local`].
///
/// # Errors
/// The parameters are outside the domain of the model, or derivatives at the operating point are not finite.
pub fn local(model: &impl PlantModel, at: &OperatingPoint<'_>) -> Result<Local, Failure> {
    let OperatingPoint { parameters, states, inputs, past, at_rest } = *at;
    let (values, LeftOut { frictionless, selected, exceeded }) = look(model, at)?;
    let constants: Vec<Dual7> = parameters.iter().map(|&p| p.into()).collect();
    let columns = states.len() + inputs.len() + past.len();
    let mut slopes = DMatrix::zeros(values.len(), columns);
    let still = || vec![0.0; columns];
    // Delayed quantities come after the signals.
    let row = |rate: usize| if rate < states.len() { rate } else { rate + model.interface().signals.len() };
    let without = |of: Selected<f64>| Selected {
        taken: still(),
        other: still(),
        rates: of.rates.into_iter().map(row).collect(),
        place: of.place,
    };
    let mut selected: Vec<Selected<Vec<f64>>> = selected.into_iter().map(without).collect();
    for first in (0..columns).step_by(DIRECTIONS) {
        let variable = |(j, &value): (usize, &f64)| {
            let direction = j.wrapping_sub(first);
            if direction < DIRECTIONS { Dual::variable(value, direction) } else { Dual::from(value) }
        };
        let all: Vec<Dual7> = states.iter().chain(inputs).chain(past).enumerate().map(variable).collect();
        let (states, others) = all.split_at(states.len());
        let (inputs, past) = others.split_at(inputs.len());
        let (along, left_out) = look(model, &OperatingPoint { parameters: &constants, states, inputs, past, at_rest })?;
        let last = columns.min(first + DIRECTIONS);
        for (of, along) in selected.iter_mut().zip(&left_out.selected) {
            of.taken[first..last].copy_from_slice(&along.taken.tangent[..last - first]);
            of.other[first..last].copy_from_slice(&along.other.tangent[..last - first]);
        }
        for (i, row) in along.iter().enumerate() {
            for j in first..last {
                slopes[(i, j)] = row.tangent[j - first];
            }
        }
    }
    let (rates, others) = values.split_at(states.len());
    let (signals, past) = others.split_at(others.len() - past.len());
    if !slopes.iter().chain(rates).all(|x| x.is_finite()) {
        return Err(Failure::Undefined(
            "the derivatives of the equations are not finite at the operating point".into(),
        ));
    }
    let names = model.states();
    let frictionless = frictionless.into_iter().map(|position| names[position].name.clone()).collect();
    let [rates, signals, past] = [rates, signals, past].map(<[f64]>::to_vec);
    Ok(Local { rates, signals, past, slopes, frictionless, selected, exceeded })
}
