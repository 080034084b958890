//! argmin's solvers on a mops problem: the oracle as its cost function.

use std::sync::Mutex;

use argmin::core::{CostFunction, Error};
use mops_core::{Halt, Oracle};

use crate::penalty::penalised;

/// The penalised objective over the whole space: points outside the box cost their distance to it on top of the value at
/// the nearest point inside, so that solvers without bounds stay near.
pub(crate) struct Cost<'a> {
    state: Mutex<State<'a>>,
}

struct State<'a> {
    oracle: &'a mut dyn Oracle,
    halt: Option<Halt>,
    objective_scale: Option<f64>,
}

/// What a point costs once the run is over: argmin ends at the target cost, and not all of its solvers take an error.
const HALTED: f64 = f64::NEG_INFINITY;

impl<'a> Cost<'a> {
    /// `unit` brings the objective to the order of 1; it is found from the first value where absent.
    pub fn new(oracle: &'a mut dyn Oracle, objective_scale: Option<f64>) -> Self {
        Self { state: Mutex::new(State { oracle, halt: None, objective_scale }) }
    }

    /// The factor of the objective.
    pub fn objective_scale(&self) -> Option<f64> {
        self.state.lock().expect("nobody panics holding the lock").objective_scale
    }

    /// Why the oracle stopped answering, if it did.
    pub fn halt(&self) -> Option<Halt> {
        self.state.lock().expect("nobody panics holding the lock").halt
    }
}

impl CostFunction for &Cost<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Error> {
        let inside: Vec<f64> = point.iter().map(|u| u.clamp(0.0, 1.0)).collect();
        let outside: f64 = point.iter().zip(&inside).map(|(a, b)| (a - b).abs()).sum();
        let mut state = self.state.lock().expect("nobody panics holding the lock");
        if state.halt.is_some() {
            return Ok(HALTED);
        }
        match state.oracle.evaluate(&[inside]) {
            Ok(answers) => {
                let cost = penalised(&answers[0]);
                // argmin's tolerances are absolute: bring the objective to the order of 1.
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
