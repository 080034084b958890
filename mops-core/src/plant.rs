//! The plant of a model: its equations at given parameters, with inputs and forces as arguments.

use crate::enclosure::Enclosure;
use crate::failure::Failure;
use crate::scalar::{Along, Scalar};

/// Where a plant is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Instant<'a, S> {
    /// Time, s.
    pub t: f64,
    /// The states, in the order of [`crate::Model::equation_states`].
    pub x: &'a [S],
    /// The inputs as they reach the plant, in the order of [`crate::Interface::inputs`].
    pub u: &'a [S],
    /// What is added to the right-hand sides, one for every [`crate::Port::Process`] in the order of
    /// [`crate::Interface::ports`]; 0 in the declared model.
    pub w: &'a [S],
}

/// The instant of an event, and how it moves with the parameters.
#[derive(Debug, Clone, Copy)]
pub struct EventInstant<'a, S> {
    /// Time, states, inputs and forces just before the event; the inputs move with it.
    pub at: Instant<'a, S>,
    /// Rates of the inputs, per s.
    pub du: &'a [f64],
    /// The derivatives of the time of the event with respect to the directions of the scalar; its value is 0.
    pub delay: S,
}

/// What is known of a plant over a time: bounds of what an [`Instant`] gives.
#[derive(Debug, Clone, Copy)]
pub struct Span<'a> {
    /// Time, s.
    pub time: Enclosure,
    /// The states.
    pub x: &'a [Enclosure],
    /// The inputs.
    pub u: &'a [Enclosure],
    /// What is added to the right-hand sides.
    pub w: &'a [Enclosure],
}

/// A plant: `x' = f(t, x, u, w)` at given parameters, in modes of its own between which guards switch.
///
/// It is written once over [`Scalar`], so that it runs with values and with exact tangents, those of jumps at events included.
/// All of its state that is not in `x` is its mode, which changes in [`Plant::switch`], [`Plant::rest`], [`Plant::settle`] and
/// [`Plant::linearised_at`] alone; between them it is smooth.
pub trait Plant<S: Scalar> {
    /// The states at time 0.
    fn start(&self) -> Vec<S>;

    /// Whether a simulation can begin here.
    ///
    /// # Errors
    /// Why it cannot: equations that have no solution here, or parameters that contradict one another.
    fn can_start(&self, _at: &Instant<'_, S>) -> Result<(), Failure> {
        Ok(())
    }

    /// Writes `x'` in the present mode.
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]);

    /// The value of a signal, by its index in the interface; where not said otherwise, signals are the states, then the inputs.
    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        at.x.get(signal).copied().unwrap_or_else(|| at.u[signal - at.x.len()])
    }

    /// Number of guards in the present mode.
    fn guards(&self) -> usize {
        0
    }

    /// The value of a guard: the mode holds while it is not negative.
    fn guard(&self, _index: usize, _at: &Instant<'_, S>) -> S {
        S::from(1.0)
    }

    /// The state that a guard is, and the factor that it has: the speed of a joint that slides. `None` where it must be computed; the
    /// search for events then reads one state instead of all.
    fn guard_shows(&self, _index: usize) -> Option<(usize, f64)> {
        None
    }

    /// The rate of a guard along the solution, per s; `du` are the rates of the inputs. `None` where only values of the guard
    /// tell it.
    fn guard_rate(&self, _index: usize, _at: &Instant<'_, S>, _du: &[f64]) -> Option<f64> {
        None
    }

    /// A guard became negative: changes the mode; where the state jumps, writes the state after the event to `x`, in which the
    /// state before it stands. Returns what happened; an empty text where a user need not know.
    fn switch(&mut self, _index: usize, _event: &EventInstant<'_, S>, _x: &mut [S]) -> &str {
        ""
    }

    /// Whether it encloses its guards.
    fn has_bounds(&self) -> bool {
        false
    }

    /// Bounds of a guard and of its rate over a time; asked for where [`Plant::has_bounds`].
    fn enclose_guard(&self, _index: usize, _over: &Span<'_>) -> Enclosure {
        Enclosure::UNKNOWN
    }

    /// The events of a guard accumulate, in intervals below `close` in s: writes the state in which they end to `x` and returns
    /// what happened.
    ///
    /// # Errors
    /// There is no such state: which events accumulate, and the way out. The simulation fails.
    fn rest(&mut self, _index: usize, _event: &EventInstant<'_, S>, _close: f64, _x: &mut [S]) -> Result<&str, String> {
        Err("a mode of the model changes to and fro without end".to_owned())
    }

    /// Finds the mode: at the start, at each of its own breaks, and where inputs or forces jump.
    fn settle(&mut self, _at: &Instant<'_, S>) {}

    /// Takes the mode in which the plant is linearised. Where it is `at_rest`, or a search for such a point passes, no joint has
    /// dry friction; else joints have none whose speed is as good as 0, and the others slide the way they move. Returns the
    /// positions, as states, of the joints whose dry friction is left out.
    ///
    /// # Errors
    /// The plant has no linearisation.
    fn linearised_at(&mut self, at: &Instant<'_, S>, _at_rest: bool) -> Result<Vec<usize>, Failure> {
        self.settle(at);
        Ok(Vec::new())
    }

    /// The typical size of a state, in its unit; `None` where only the simulation tells it.
    fn scale(&self, _state: usize) -> Option<f64> {
        None
    }

    /// The next time after `t` at which the plant itself takes a sample or jumps, s; infinity if never.
    fn next_break(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// The longest step within which the plant is well resolved, s: a state that rests says nothing of it.
    fn longest_step(&self) -> f64 {
        f64::INFINITY
    }

    /// The entries of the Jacobian `df/dx` that may differ from 0, as pairs of row and column; `None` if all may. The stiff
    /// method solves with the band that they span.
    fn jacobian_pattern(&self) -> Option<Vec<(usize, usize)>> {
        None
    }

    /// Passes each entry of the Jacobian `df/dx` on as row, column and value, and returns `true`; `false` where the plant has
    /// no exact one, and differences must do.
    fn jacobian(&self, _at: &Instant<'_, S>, _entry: &mut dyn FnMut(usize, usize, f64)) -> bool {
        false
    }

    /// What a failure of the simulation means for this plant.
    fn explain(&self, failure: Failure) -> Failure {
        failure
    }
}

impl<S: Scalar, P: Plant<S> + ?Sized> Plant<S> for Box<P> {
    fn start(&self) -> Vec<S> {
        (**self).start()
    }
    fn can_start(&self, at: &Instant<'_, S>) -> Result<(), Failure> {
        (**self).can_start(at)
    }
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        (**self).rates(at, dx)
    }
    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        (**self).signal(signal, at)
    }
    fn guards(&self) -> usize {
        (**self).guards()
    }
    fn guard(&self, index: usize, at: &Instant<'_, S>) -> S {
        (**self).guard(index, at)
    }
    fn guard_shows(&self, index: usize) -> Option<(usize, f64)> {
        (**self).guard_shows(index)
    }
    fn guard_rate(&self, index: usize, at: &Instant<'_, S>, du: &[f64]) -> Option<f64> {
        (**self).guard_rate(index, at, du)
    }
    fn switch(&mut self, index: usize, event: &EventInstant<'_, S>, x: &mut [S]) -> &str {
        (**self).switch(index, event, x)
    }
    fn has_bounds(&self) -> bool {
        (**self).has_bounds()
    }
    fn enclose_guard(&self, index: usize, over: &Span<'_>) -> Enclosure {
        (**self).enclose_guard(index, over)
    }
    fn rest(&mut self, index: usize, event: &EventInstant<'_, S>, close: f64, x: &mut [S]) -> Result<&str, String> {
        (**self).rest(index, event, close, x)
    }
    fn settle(&mut self, at: &Instant<'_, S>) {
        (**self).settle(at)
    }
    fn linearised_at(&mut self, at: &Instant<'_, S>, at_rest: bool) -> Result<Vec<usize>, Failure> {
        (**self).linearised_at(at, at_rest)
    }
    fn scale(&self, state: usize) -> Option<f64> {
        (**self).scale(state)
    }
    fn next_break(&self, t: f64) -> f64 {
        (**self).next_break(t)
    }
    fn longest_step(&self) -> f64 {
        (**self).longest_step()
    }
    fn jacobian_pattern(&self) -> Option<Vec<(usize, usize)>> {
        (**self).jacobian_pattern()
    }
    fn jacobian(&self, at: &Instant<'_, S>, entry: &mut dyn FnMut(usize, usize, f64)) -> bool {
        (**self).jacobian(at, entry)
    }
    fn explain(&self, failure: Failure) -> Failure {
        (**self).explain(failure)
    }
}

/// A model that can be opened at its ports.
pub trait Open: Send + Sync {
    /// The plant at these values of the model's parameters.
    ///
    /// # Errors
    /// Parameters for which the model is not defined.
    fn open<'a>(&'a self, parameters: &'a [f64]) -> Result<Box<dyn Plant<f64> + 'a>, Failure>;

    /// The same with tangents.
    ///
    /// # Errors
    /// As [`Open::open`].
    fn open_along<'a>(&'a self, parameters: &'a [Along]) -> Result<Box<dyn Plant<Along> + 'a>, Failure>;

    /// Accuracy and limits of its simulations.
    fn tolerance(&self) -> crate::Tolerance;
}

/// A scalar in which effects and opened models run: a number, or a number with tangents.
pub trait Opening: Scalar {
    /// [`Open::open`] or [`Open::open_along`].
    ///
    /// # Errors
    /// As these.
    fn open<'a>(model: &'a dyn Open, parameters: &'a [Self]) -> Result<Box<dyn Plant<Self> + 'a>, Failure>;

    /// [`crate::Effect::act`] or [`crate::Effect::act_along`].
    fn act(effect: &dyn crate::Effect, strengths: &[Self]) -> Box<dyn crate::Acting<Self>>;
}

impl Opening for f64 {
    fn open<'a>(model: &'a dyn Open, parameters: &'a [Self]) -> Result<Box<dyn Plant<Self> + 'a>, Failure> {
        model.open(parameters)
    }
    fn act(effect: &dyn crate::Effect, strengths: &[Self]) -> Box<dyn crate::Acting<Self>> {
        effect.act(strengths)
    }
}

impl Opening for Along {
    fn open<'a>(model: &'a dyn Open, parameters: &'a [Self]) -> Result<Box<dyn Plant<Self> + 'a>, Failure> {
        model.open_along(parameters)
    }
    fn act(effect: &dyn crate::Effect, strengths: &[Self]) -> Box<dyn crate::Acting<Self>> {
        effect.act_along(strengths)
    }
}
