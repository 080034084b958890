//! Receivers of the progress of a simulation.

use mops_core::Failure;
use mops_core::model::Work;
use mops_language::Scalar;

use super::driven::Driven;
use super::step::Step;

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
