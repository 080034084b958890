//! Cost function for argmin's solvers, evaluated through the oracle.

use std::sync::Mutex;

use argmin::core::{CostFunction, Error};
use mops_core::{Halt, Oracle};

use crate::penalty::penalised;

/// Penalised objective over the whole space. Outside the box, the cost is the value at the nearest point inside plus a
/// penalty on the distance to it; so solvers without bounds stay near the box.
pub(crate) struct Cost<'a> {
    state: Mutex<State<'a>>,
}

struct State<'a> {
    oracle: &'a mut dyn Oracle,
    halt: Option<Halt>,
    objective_scale: Option<f64>,
}

/// Cost of every point after the end of the run. argmin stops at the target cost; not all of its solvers handle errors.
const HALTED: f64 = f64::NEG_INFINITY;

impl<'a> Cost<'a> {
    /// Creates the cost function. `objective_scale` brings the objective to the order of 1; if absent, the first value
    /// defines it.
    pub fn new(oracle: &'a mut dyn Oracle, objective_scale: Option<f64>) -> Self {
        Self { state: Mutex::new(State { oracle, halt: None, objective_scale }) }
    }

    /// Returns the scale factor of the objective.
    pub fn objective_scale(&self) -> Option<f64> {
        self.state.lock().expect("no thread panics while holding the lock").objective_scale
    }

    /// Returns the reason why the run ended, if it did.
    pub fn halt(&self) -> Option<Halt> {
        self.state.lock().expect("no thread panics while holding the lock").halt
    }
}

impl CostFunction for &Cost<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        let inside: Vec<f64> = point.iter().map(|u| u.clamp(0.0, 1.0)).collect();
        let outside: f64 = point.iter().zip(&inside).map(|(a, b)| (a - b).abs()).sum();
        let mut state = self.state.lock().expect("no thread panics while holding the lock");
        if state.halt.is_some() {
            return Ok(HALTED);
        }
        match state.oracle.evaluate(&[inside]) {
            Ok(answers) => {
                let cost = penalised(&answers[0]);
                // argmin's tolerances are absolute: scale the objective to the order of 1.
                if state.objective_scale.is_none() && cost.is_finite() && cost != 0.0 {
                    state.objective_scale =
                        Some(if (1e-3..1e3).contains(&cost.abs()) { 1.0 } else { 1.0 / cost.abs() });
                }
                Ok(cost * state.objective_scale.unwrap_or(1.0) + 10.0 * outside)
            }
            Err(halt) => {
                state.halt = Some(halt);
                Ok(HALTED)
            }
        }
    }
}
