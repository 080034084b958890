//! Parts of a plant that only some plants have.

use mops_language::{Scalar, enclosure::Enclosure};
use mops_linear::Clock;

use super::Instant;

/// Rates of the inputs by their index, per s.
pub type InputRates<'a> = &'a dyn Fn(usize) -> f64;

/// The instant of an event and its derivatives with respect to the parameters.
#[derive(Clone, Copy)]
pub struct EventInstant<'a, S> {
    /// Time, states, inputs and forces just before the event; the inputs vary with the event time.
    pub at: Instant<'a, S>,
    /// Rates of the inputs, per s.
    pub du: InputRates<'a>,
    /// Derivatives of the event time along the directions of the scalar; the value part is 0.
    pub delay: S,
}

/// Modes and events: a mode is valid while its guards are not negative.
pub trait Events<S: Scalar> {
    /// Returns the number of guards in the current mode.
    fn guards(&self) -> usize;

    /// Returns the value of a guard: the mode is valid while the guard is not negative.
    fn guard(&self, index: usize, at: &Instant<'_, S>, du: InputRates<'_>) -> S;

    /// Returns the index and factor of the state that a guard is proportional to, such as the speed of a sliding joint.
    /// The event search then reads one state instead of all. `None` if the guard must be computed.
    fn guard_state(&self, _index: usize) -> Option<(usize, f64)> {
        None
    }

    /// Returns the rate of a guard along the solution, per s. `None` if only values of the guard are available.
    fn guard_rate(&self, _index: usize, _at: &Instant<'_, S>, _du: InputRates<'_>) -> Option<f64> {
        None
    }

    /// Decides which events wait at the start, in its mode.
    fn arm(&mut self, _at: &Instant<'_, S>) {}

    /// Changes the mode after a guard became negative. If the state jumps, overwrites the state before the event in `x`
    /// with the state after it. Returns a description of the event, empty if users need not see it.
    fn switch(&mut self, index: usize, event: &EventInstant<'_, S>, x: &mut [S]) -> &str;

    /// Handles accumulating (Zeno) events of a guard, at intervals below `close` in s. Writes the limit state to `x`
    /// and returns a description.
    ///
    /// # Errors
    /// Returns an error if there is no limit state: which events accumulate, and how to avoid them. The simulation
    /// fails.
    fn rest(&mut self, _index: usize, _event: &EventInstant<'_, S>, _close: f64, _x: &mut [S]) -> Result<&str, String> {
        Err("a mode of the model chatters without end".to_owned())
    }
}

/// Instants, known beforehand, at which the plant itself samples or jumps: of clocks, where a jump arrives after a
/// delay, where a law changes with time.
pub trait Breaks<S: Scalar> {
    /// Returns the next break after `t`, s; infinity if none follows.
    fn next(&self, t: f64) -> f64;

    /// Passes the breaks that are due; called at the start and at every jump of an input or a force as well. `at` has
    /// the states before it; states that jump get their new values in `x`. Returns the derivatives of the time of the
    /// break along the directions of the scalar, with value 0; NaN if breaks with different ones coincide.
    fn pass(&mut self, at: &Instant<'_, S>, x: &mut [S]) -> S;

    /// Returns the clocks, if a linearisation can treat them.
    fn clocks(&self) -> Vec<Clock> {
        Vec::new()
    }

    /// Writes the changes of the memory of all clocks at an instant of each, its next value minus the present one, to
    /// their states in `dx`.
    fn changes(&self, _at: &Instant<'_, S>, _dx: &mut [S]) {}
}

/// Quantities over a part of an accepted step, see [`Memory::past`].
#[derive(Debug, Clone, Copy)]
pub struct Past<'a, S> {
    /// Start and end of the part, s.
    pub time: [f64; 2],
    /// Values at [`crate::Trace::NODES`] of the part.
    pub values: &'a [Vec<S>; 5],
    /// Values at [`crate::Trace::CHECKS`] of the part, to compare the quartic through the others with.
    pub checks: &'a [Vec<S>; 2],
    /// Changes of the quantities by rounding of the states, if measured, otherwise empty.
    pub roughness: &'a [f64],
    /// True if the part is not halved any more.
    pub is_last: bool,
    /// True if the quantities may jump at the start of the part, before the simulation.
    pub restarts: bool,
}

/// Part of the past before the start, in which the inputs are smooth and the states rest.
pub struct Stretch<'a, S> {
    /// Start and end, s.
    pub time: [f64; 2],
    /// The states.
    pub x: &'a [S],
    /// Returns inputs and forces at a time.
    pub at: &'a dyn Fn(f64) -> [Vec<S>; 2],
    /// Returns the rate of an input at a time, per s.
    pub rate: &'a dyn Fn(f64, usize) -> f64,
}

/// What the plant remembers besides its states: the past of delayed quantities, and hysteresis.
pub trait Memory<S: Scalar> {
    /// Returns how far back the past matters, s.
    fn reach(&self) -> f64 {
        self.delays().iter().sum()
    }

    /// Takes the past as constant: `at` is the beginning of what is known, or the start with the inputs just before it.
    /// States that depend on it are completed in `x`; they rest until the start.
    fn begin(&mut self, at: &Instant<'_, S>, x: &mut [S]);

    /// Follows a stretch of the past before the start, apart from [`Memory::remember`].
    fn follow(&mut self, _over: &Stretch<'_, S>) {}

    /// Passes a jump of the inputs, from those `before` to those `after`.
    fn jump(&mut self, _before: &EventInstant<'_, S>, _after: &EventInstant<'_, S>) {}

    /// Returns the times by which quantities are delayed, s.
    fn delays(&self) -> Vec<f64>;

    /// Returns the quantities that are delayed.
    fn past(&self, at: &Instant<'_, S>) -> Vec<S>;

    /// Stores the quantities of [`Memory::past`] over a part of an accepted step or of the past, or returns false if
    /// the quartic through their values is not accurate enough: the part is then halved.
    fn remember(&mut self, over: &Past<'_, S>) -> bool;

    /// Returns the delayed values of these quantities at a time.
    fn delayed(&self, t: f64) -> Vec<S>;

    /// Takes the past of these quantities as constant, with these values.
    fn hold(&mut self, past: &[S]);
}

/// Jacobian `df/dx` of a plant.
pub trait Jacobian<S: Scalar> {
    /// Returns the pairs of row and column whose entries may be nonzero. The stiff method uses the band spanned by
    /// them.
    fn pattern(&self) -> Vec<(usize, usize)>;

    /// Passes each entry as row, column and value to `entry` and returns `true`. Returns `false` if there are no exact
    /// entries; finite differences are then used.
    fn entries(&self, _at: &Instant<'_, S>, _entry: &mut dyn FnMut(usize, usize, f64)) -> bool {
        false
    }
}

/// Bounds on the time, states, inputs and forces of a plant over a time interval, see [`Instant`].
#[derive(Debug, Clone, Copy)]
pub struct Span<'a> {
    /// Time interval, s.
    pub time: Enclosure,
    /// Bounds of the states.
    pub x: &'a [Enclosure],
    /// Bounds of the inputs.
    pub u: &'a [Enclosure],
    /// Bounds of the additive terms of the right-hand sides.
    pub w: &'a [Enclosure],
}

/// Bounds of guards and signals over a time interval.
pub trait Bounds {
    /// Returns bounds of a guard and of its rate.
    fn of_guard(&self, index: usize, over: &Span<'_>) -> Enclosure;

    /// Returns bounds of a signal and of its rate.
    fn of_signal(&self, signal: usize, over: &Span<'_>) -> Enclosure;
}
