//! The simulation kernel: adaptive Runge-Kutta steps with dense output, events, and the elements models are made of.

/// Evaluates an expression with the constant `$N` as the number of states, where it is small and there are no tangents; else with 0,
/// which stands for any number. The compiler unrolls loops over a known number of states.
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
use mops_core::{Failure, Mistake, Quantity, Scalar, Unit, Work};

pub use mops_core::{IntegrationMethod, Tolerance};

use dormand_prince::DormandPrince;
pub use driven::Driven;
pub(crate) use esdirk::groups;
use integrate::Attempt;
pub use integrate::integrate;
pub(crate) use local::rests;
pub(crate) use plant_model::shown;
pub use plant_model::{PlantModel, Simulated};
pub(crate) use record::{Recording, record, tangents_of, wanted};
pub use step::Step;

/// What the integrator steps: a closed system `x' = f(t, x)`, with modes between which events switch. Its inputs are its own.
///
/// [`Driven`] is a [`mops_core::Plant`] as such a system; a model is a plant.
pub trait Dynamics<S: Scalar> {
    /// Writes `x'` at time `t` in the present mode. Within a step the mode and its inputs are smooth.
    fn derivative(&self, t: f64, x: &[S], dx: &mut [S]);

    /// A step of the explicit method, tried: the state after it goes to `next`, and the norm of its errors comes back. Provided here,
    /// so that the stages are compiled together with the equations: as calls these are 6 % of the instructions of `pid-design`.
    #[doc(hidden)]
    fn attempt(&self, method: &mut DormandPrince<S>, at: Attempt<'_, S>, next: &mut [S]) -> f64 {
        by_size!(at.x.len(), S, N => method.attempt_of::<Self, N>(self, at, next))
    }

    /// The value of a signal; where not said otherwise, signals are the states.
    fn signal(&self, signal: usize, _t: f64, x: &[S]) -> S {
        x[signal]
    }

    /// The values of a signal at several instants. Provided here, so that it is compiled together with the signal.
    #[doc(hidden)]
    fn signal_at(&self, signal: usize, times: &[f64; 5], states: &[Vec<S>; 5]) -> [S; 5] {
        let mut values = [S::from(0.0); 5];
        for ((value, &t), x) in values.iter_mut().zip(times).zip(states) {
            *value = self.signal(signal, t, x);
        }
        values
    }

    /// Number of guards in the present mode.
    fn guards(&self) -> usize {
        0
    }

    /// The value of a guard: the mode holds while it is not negative.
    fn guard(&self, _index: usize, _t: f64, _x: &[S]) -> S {
        S::from(1.0)
    }

    /// A guard became negative: changes the mode, and the state where it jumps; tangents of `x` are those along the
    /// event, whose time moves too. Returns what happened; an empty text where a user need not know.
    fn switch(&mut self, _index: usize, _t: f64, _x: &mut [S]) -> &str {
        ""
    }

    /// As [`mops_core::Plant::guard_shows`].
    fn guard_shows(&self, _index: usize) -> Option<(usize, f64)> {
        None
    }

    /// The values of a guard at several instants; provided here as [`Dynamics::signal_at`].
    #[doc(hidden)]
    fn guard_at(&self, index: usize, times: &[f64; 3], states: &[Vec<S>; 3]) -> [S; 3] {
        let mut values = [S::from(0.0); 3];
        for ((value, &t), x) in values.iter_mut().zip(times).zip(states) {
            *value = self.guard(index, t, x);
        }
        values
    }

    /// The rate of a guard along the solution, per s; `None` where only values of the guard tell it.
    fn guard_rate(&self, _index: usize, _t: f64, _x: &[S]) -> Option<f64> {
        None
    }

    /// Whether it encloses its guards.
    fn has_bounds(&self) -> bool {
        false
    }

    /// Bounds of a guard and of its rate over a time in which the states stay within their bounds `x`; asked for where
    /// [`Dynamics::has_bounds`].
    fn enclose_guard(&self, _index: usize, _time: Enclosure, _x: &[Enclosure]) -> Enclosure {
        Enclosure::UNKNOWN
    }

    /// The events of a guard accumulate at this instant, in intervals below `close` in s: takes the state to where it rests
    /// and returns what happened.
    ///
    /// # Errors
    /// There is no such state: which events accumulate, and the way out. The simulation fails.
    fn rest(&mut self, _index: usize, _t: f64, _close: f64, _x: &mut [S]) -> Result<&str, String> {
        Err("a mode of the model changes to and fro without end".to_owned())
    }

    /// The typical size of a state, in its unit; `None` where only the simulation tells it.
    fn scale(&self, _state: usize) -> Option<f64> {
        None
    }

    /// The events that follow happen later by this number, which has tangents and no value: that is how the parameters move
    /// their time. What resets read of time and of inputs moves with it.
    fn delay_events(&mut self, _delay: S) {}

    /// The state that a signal shows as it is; `None` where it must be computed.
    fn shows(&self, _signal: usize) -> Option<usize> {
        None
    }

    /// The next time after `t` at which an input jumps or a sample is taken; infinity if never.
    fn next_break(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Longest step within which the inputs are well resolved, s: a state that rests says nothing of them.
    fn longest_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Longest step in which an explicit method damps what decays fast, s: at rest no error tells it, and tangents grow.
    fn damped_step(&self) -> f64 {
        f64::INFINITY
    }

    /// The places of the Jacobian `df/dx` that may differ from 0, as pairs of row and column; `None` if all may. The stiff
    /// method solves with the band that they span.
    fn jacobian_pattern(&self) -> Option<Vec<(usize, usize)>> {
        None
    }

    /// Tells every entry of the Jacobian `df/dx` as row, column and value, and returns `true`; `false` where the
    /// implementor has no exact one, and differences must do.
    fn jacobian(&self, _t: f64, _x: &[S], _entry: &mut dyn FnMut(usize, usize, f64)) -> bool {
        false
    }

    /// A break was reached (also called once at the start): inputs take their new values.
    fn pass_break(&mut self, _t: f64, _x: &mut [S]) {}

    /// Whether it wants to be told of accepted steps.
    fn remembers(&self) -> bool {
        false
    }

    /// A step was accepted: a delay keeps what will come out of it later.
    fn accepted(&mut self, _step: &Step<S>) {}
}

/// A time that a model's options give under `key`, in s.
///
/// # Errors
/// A quantity that is no time.
pub fn seconds(key: &str, time: Option<&Quantity>) -> Result<Option<f64>, Mistake> {
    time.map(|q| q.to(&Unit::known("s"))).transpose().map_err(|e| Mistake::new(key, e))
}

/// What the integrator tells of a simulation: steps, then events.
pub trait Sink<S: Scalar, D: Dynamics<S> + ?Sized> {
    /// A step was accepted; `dynamics` is in the mode that held during it.
    fn step(&mut self, step: &Step<S>, dynamics: &D);
    /// Whether it reads states within steps; if not, they are not prepared.
    fn reads_steps(&self) -> bool {
        true
    }
    /// Why the simulation must end at this time, s, if it must; asked before every step.
    fn ends(&self, _t: f64) -> Option<Failure> {
        None
    }
    /// The end was reached: inputs have their values of that instant.
    fn end(&mut self, _t: f64, _x: &[S], _dynamics: &D) {}
    /// The mode changed.
    fn event(&mut self, _t: f64, _what: &str) {}
}

/// Nobody listens.
impl<S: Scalar, D: Dynamics<S> + ?Sized> Sink<S, D> for () {
    fn step(&mut self, _: &Step<S>, _: &D) {}
    fn reads_steps(&self) -> bool {
        false
    }
}

/// What a simulation gives: the last state, and the work.
pub type Integrated<S> = Result<(Vec<S>, Work), Failure>;
