//! Simulation kernel: adaptive Runge-Kutta methods with dense output, event location, and the elements that models are
//! built from.

/// Evaluates an expression with the constant `$N`: the number of states where it is small and there are no tangents.
/// Otherwise `$N` is 0, which means any number. The compiler unrolls loops over a known number of states.
macro_rules! by_size {
    ($states:expr, $S:ty, $N:ident => $body:expr) => {
        match if <$S as mops_language::Scalar>::DIRECTIONS == 0 { $states } else { 0 } {
            1 => {
                const $N: usize = 1;
                $body
            }
            2 => {
                const $N: usize = 2;
                $body
            }
            3 => {
                const $N: usize = 3;
                $body
            }
            4 => {
                const $N: usize = 4;
                $body
            }
            5 => {
                const $N: usize = 5;
                $body
            }
            6 => {
                const $N: usize = 6;
                $body
            }
            _ => {
                const $N: usize = 0;
                $body
            }
        }
    };
}

mod dormand_prince;
pub mod drive;
mod driven;
pub mod elements;
mod esdirk;
mod events;
pub mod friction;
mod inputs;
mod integrable;
mod integrate;
mod local;
pub mod mechanism;
mod past;
mod plant_model;
mod record;
mod step;
mod step_size;
mod weights;

use mops_core::{Failure, StudyError, model::Work};
use mops_language::{Quantity, Scalar, Unit};

pub use mops_core::plant::{IntegrationMethod, Tolerance};

pub use driven::Driven;
pub(crate) use driven::mobility;
pub(crate) use events::{common, shift};
pub use inputs::Inputs;
pub use integrable::Integrable;
pub use integrate::integrate;
pub(crate) use integrate::integrate_for;
pub(crate) use local::rests;
pub use plant_model::{PlantModel, Simulated};
pub(crate) use plant_model::{Simulation, cut_at, shown};
pub use record::{Recording, Wanted, record};
pub(crate) use record::{allowed, tangents_of, wanted};
pub use step::Step;
pub use step_size::StepSizes;

/// Returns the time in s that a model's options give under `key`.
///
/// # Errors
/// The quantity is not a time.
pub fn seconds(key: &str, time: Option<&Quantity>) -> Result<Option<f64>, StudyError> {
    time.map(|q| q.to(&Unit::known("s"))).transpose().map_err(|e| StudyError::new(key, e))
}

/// Relative difference of two times up to which they are the same instant: 3 times 0.1 s is 0.3 s.
const SAME_INSTANT: f64 = 8.0 * f64::EPSILON;

/// Returns the latest time that is the same instant as `t`.
pub(crate) fn latest(t: f64) -> f64 {
    t + SAME_INSTANT * t.abs()
}

/// Returns true if `t` has reached a time, within rounding.
pub(crate) fn is_due(time: f64, t: f64) -> bool {
    time <= latest(t)
}

/// Returns the first of these times; of those at the same instant, the last, so that all are due.
pub(crate) fn next_of(times: impl Iterator<Item = f64> + Clone) -> f64 {
    let first = times.clone().fold(f64::INFINITY, f64::min);
    times.filter(|&time| is_due(time, first)).fold(first, f64::max)
}

/// Receiver of the progress of a simulation: of every step, then of the events at its end.
pub trait Sink<S: Scalar, P: ?Sized> {
    /// Handles an accepted step; `system` is in the mode that was active during the step.
    fn step(&mut self, step: &Step<S>, system: &Driven<'_, S, P>);
    /// Returns true if states within steps are read; if not, dense output is not prepared for this sink.
    fn reads_steps(&self) -> bool {
        true
    }
    /// Returns the reason why the simulation must end at time `t`, s, if it must. Called before every step.
    fn ends(&self, _t: f64) -> Option<Failure> {
        None
    }
    /// Handles the end of the simulation; the inputs have their values at that instant.
    fn end(&mut self, _t: f64, _x: &[S], _system: &Driven<'_, S, P>) {}
    /// Handles a change of the mode.
    fn event(&mut self, _t: f64, _what: &str) {}
    /// Handles the end of a step by an event or a break. `moves` are the derivatives of its time along the directions
    /// of the scalar, with value 0.
    fn restart(&mut self, _t: f64, _moves: S) {}
}

/// Sink that ignores steps and events.
impl<S: Scalar, P: ?Sized> Sink<S, P> for () {
    fn step(&mut self, _: &Step<S>, _: &Driven<'_, S, P>) {}
    fn reads_steps(&self) -> bool {
        false
    }
}

/// Result of a simulation: the final state and the computational work.
pub type Integrated<S> = Result<(Vec<S>, Work), Failure>;
