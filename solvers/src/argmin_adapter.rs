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
}

/// argmin only knows errors; the halt itself waits in [`Cost::halt`].
#[derive(Debug)]
struct Halted;

impl std::fmt::Display for Halted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the run is over")
    }
}

impl std::error::Error for Halted {}

impl<'a> Cost<'a> {
    pub fn new(oracle: &'a mut dyn Oracle) -> Self {
        Self { state: Mutex::new(State { oracle, halt: None }) }
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
        match state.oracle.evaluate(&[inside]) {
            Ok(answers) => Ok(penalised(&answers[0]) + 10.0 * outside),
            Err(halt) => {
                state.halt = Some(halt);
                Err(Halted.into())
            }
        }
    }
}
