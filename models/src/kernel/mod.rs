//! Simulation kernel: adaptive Runge-Kutta methods with dense output, event location, and the elements that models are
//! built from.

/// Evaluates an expression with the constant `$N`: the number of states where it is small and there are no tangents.
/// Otherwise `$N` is 0, which means any number. The compiler unrolls loops over a known number of states.
macro_rules! by_size {
    ($states:expr, $S:ty, $N:ident => $body:expr) => {
        match if <$S as mops_core::Scalar>::DIRECTIONS == 0 { $states } else { 0 } {
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

mod banded;
mod dormand_prince;
pub mod drive;
mod driven;
pub mod elements;
mod esdirk;
mod events;
pub mod friction;
mod integrate;
mod local;
pub mod mechanism;
mod plant_model;
mod record;
mod step;
mod step_size;
mod weights;

use mops_core::enclosure::Enclosure;
use mops_core::{Failure, Quantity, Scalar, StudyError, Unit, Work};

pub use mops_core::{IntegrationMethod, Tolerance};

use dormand_prince::DormandPrince;
pub use driven::Driven;
pub(crate) use esdirk::groups;
pub(crate) use events::{common, shift};
use integrate::Attempt;
pub use integrate::integrate;
pub(crate) use local::rests;
pub use plant_model::{PlantModel, Simulated};
pub(crate) use plant_model::{cut_at, shown};
pub(crate) use record::{Recording, allowed, record, remember, tangents_of, wanted};
pub use step::Step;

/// Closed system `x' = f(t, x)` that the integrator steps, with modes between which events switch. The system supplies
/// its own inputs.
///
/// [`Driven`] turns a [`mops_core::Plant`] and its inputs into such a system; a model is a plant.
pub trait Dynamics<S: Scalar> {
    /// Writes `x'` at time `t` in the current mode to `dx`. Within a step the mode and its inputs are smooth.
    fn derivative(&self, t: f64, x: &[S], dx: &mut [S]);

    /// Attempts a step of the explicit method: writes the state after the step to `next` and returns its weighted error
    /// norm. Provided here so that the stages are compiled together with the equations: as calls they take 6 % of the
    /// instructions of `pid-design`.
    #[doc(hidden)]
    fn attempt(&self, method: &mut DormandPrince<S>, at: Attempt<'_, S>, next: &mut [S]) -> f64 {
        by_size!(at.x.len(), S, N => method.attempt_of::<Self, N>(self, at, next))
    }

    /// Returns the value of a signal. By default, signals are the states.
    fn signal(&self, signal: usize, _t: f64, x: &[S]) -> S {
        x[signal]
    }

    /// Returns the values of a signal at several instants. Provided here so that the loop is compiled together with the
    /// signal.
    #[doc(hidden)]
    fn signal_at(&self, signal: usize, times: &[f64; 5], states: &[Vec<S>; 5]) -> [S; 5] {
        let mut values = [S::from(0.0); 5];
        for ((value, &t), x) in values.iter_mut().zip(times).zip(states) {
            *value = self.signal(signal, t, x);
        }
        values
    }

    /// Returns the number of guards in the current mode.
    fn guards(&self) -> usize {
        0
    }

    /// Returns the value of a guard. The mode remains active while no guard is negative.
    fn guard(&self, _index: usize, _t: f64, _x: &[S]) -> S {
        S::from(1.0)
    }

    /// Handles an event (a guard became negative): changes the mode, and the state where it jumps. The tangents of `x`
    /// are taken along the event, whose time also varies. Returns a description of the event; empty for events that are
    /// not reported to the user.
    fn switch(&mut self, _index: usize, _t: f64, _x: &mut [S]) -> &str {
        ""
    }

    /// Returns the state and the factor of a guard that is a scaled state; see [`mops_core::Plant::guard_shows`].
    fn guard_shows(&self, _index: usize) -> Option<(usize, f64)> {
        None
    }

    /// Returns the values of a guard at several instants. Provided here for the same reason as [`Dynamics::signal_at`].
    #[doc(hidden)]
    fn guard_at(&self, index: usize, times: &[f64; 3], states: &[Vec<S>; 3]) -> [S; 3] {
        let mut values = [S::from(0.0); 3];
        for ((value, &t), x) in values.iter_mut().zip(times).zip(states) {
            *value = self.guard(index, t, x);
        }
        values
    }

    /// Returns the rate of a guard along the solution, per s; `None` if only values of the guard are available.
    fn guard_rate(&self, _index: usize, _t: f64, _x: &[S]) -> Option<f64> {
        None
    }

    /// Returns true if bounds are available from [`Dynamics::enclose_guard`] and [`Dynamics::enclose_signal`].
    fn has_bounds(&self) -> bool {
        false
    }

    /// Returns bounds of a guard and of its rate over a time span in which the states stay within their bounds `x`.
    /// Called only if [`Dynamics::has_bounds`] returns true.
    fn enclose_guard(&self, _index: usize, _time: Enclosure, _x: &[Enclosure]) -> Enclosure {
        Enclosure::UNKNOWN
    }

    /// Returns bounds of a signal and of its rate, as [`Dynamics::enclose_guard`] does of a guard.
    fn enclose_signal(&self, _signal: usize, _time: Enclosure, _x: &[Enclosure]) -> Enclosure {
        Enclosure::UNKNOWN
    }

    /// Resolves an accumulation: the events of a guard accumulate at this instant, at intervals below `close` in s.
    /// Moves the state to its rest state and returns a description of the event.
    ///
    /// # Errors
    /// The system has no such rest state; the text names the accumulating events and the remedy. The simulation fails.
    fn rest(&mut self, _index: usize, _t: f64, _close: f64, _x: &mut [S]) -> Result<&str, String> {
        Err("a mode of the model switches back and forth without end".to_owned())
    }

    /// Returns the typical size of a state, in its unit; `None` if only the simulation can determine it.
    fn scale(&self, _state: usize) -> Option<f64> {
        None
    }

    /// Sets the delay of the events that follow: a number with zero value whose tangents are the derivatives of the
    /// event time. The time and the inputs that resets read are delayed with the event.
    fn delay_events(&mut self, _delay: S) {}

    /// Returns the state that a signal equals; `None` if the signal must be computed.
    fn shows(&self, _signal: usize) -> Option<usize> {
        None
    }

    /// Returns the next time after `t`, s, at which an input jumps or a sample is taken; infinity if none follows.
    fn next_break(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Returns the longest step that resolves the inputs, s. While the state rests, its error gives no information
    /// about the inputs.
    fn longest_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Returns the longest step with which an explicit method damps fast decaying modes, s. At rest no error limits the
    /// step, and the tangents grow.
    fn damped_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Returns the entries of the Jacobian `df/dx` that may be nonzero, as pairs of row and column; `None` if all may.
    /// The stiff method solves with the band that these entries span.
    fn jacobian_pattern(&self) -> Option<Vec<(usize, usize)>> {
        None
    }

    /// Passes every entry of the Jacobian `df/dx` to `entry` as row, column and value, and returns true. Returns false
    /// if no exact Jacobian is available and finite differences must be used.
    fn jacobian(&self, _t: f64, _x: &[S], _entry: &mut dyn FnMut(usize, usize, f64)) -> bool {
        false
    }

    /// Handles a break, and is called once at the start: inputs take their new values. Returns the derivatives of the time of
    /// the break along the directions of the scalar, with value 0.
    fn pass_break(&mut self, _t: f64, _x: &mut [S]) -> S {
        S::from(0.0)
    }

    /// Returns true if [`Dynamics::accepted`] is to be called for accepted steps.
    fn remembers(&self) -> bool {
        false
    }

    /// Handles an accepted step: a delay stores the values that it outputs later.
    fn accepted(&mut self, _step: &Step<S>) {}
}

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
pub trait Sink<S: Scalar, D: Dynamics<S> + ?Sized> {
    /// Handles an accepted step; `dynamics` is in the mode that was active during the step.
    fn step(&mut self, step: &Step<S>, dynamics: &D);
    /// Returns true if states within steps are read; if not, dense output is not prepared for this sink.
    fn reads_steps(&self) -> bool {
        true
    }
    /// Returns the reason why the simulation must end at time `t`, s, if it must. Called before every step.
    fn ends(&self, _t: f64) -> Option<Failure> {
        None
    }
    /// Handles the end of the simulation; the inputs have their values at that instant.
    fn end(&mut self, _t: f64, _x: &[S], _dynamics: &D) {}
    /// Handles a change of the mode.
    fn event(&mut self, _t: f64, _what: &str) {}
    /// Handles the end of a step by an event or a break. `moves` are the derivatives of its time along the directions of the
    /// scalar, with value 0.
    fn restart(&mut self, _t: f64, _moves: S) {}
}

/// Sink that ignores steps and events.
impl<S: Scalar, D: Dynamics<S> + ?Sized> Sink<S, D> for () {
    fn step(&mut self, _: &Step<S>, _: &D) {}
    fn reads_steps(&self) -> bool {
        false
    }
}

/// Result of a simulation: the final state and the computational work.
pub type Integrated<S> = Result<(Vec<S>, Work), Failure>;
