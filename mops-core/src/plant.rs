//! A model opened at its ports: what effects that it lacks act on.

use crate::enclosure::Enclosure;
use crate::model::Failure;
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

/// `x' = f(t, x, u, w)` at given parameters, in modes of its own between which guards switch.
pub trait Plant<S: Scalar> {
    /// The states at time 0.
    fn start(&self) -> Vec<S>;

    /// Writes `x'` in the present mode.
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]);

    /// The value of a signal, by its index in the interface; where not said otherwise, signals are the states, then the inputs.
    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        at.x.get(signal).copied().unwrap_or_else(|| at.u[signal - at.x.len()])
    }

    /// Number of its guards.
    fn guards(&self) -> usize {
        0
    }

    /// The value of a guard: the mode holds while it is not negative.
    fn guard(&self, _index: usize, _at: &Instant<'_, S>) -> S {
        S::from(1.0)
    }

    /// A guard became negative: changes the mode; where the state jumps, `x` is the state behind it. Returns what happened.
    fn switch(&mut self, _index: usize, _at: &Instant<'_, S>, _x: &mut [S]) -> &str {
        ""
    }

    /// Whether it encloses guards.
    fn has_bounds(&self) -> bool {
        false
    }

    /// Bounds of a guard and of its rate over a time, as [`Plant::guard`].
    fn enclose_guard(&self, _index: usize, _over: &Span<'_>) -> Enclosure {
        Enclosure::UNKNOWN
    }

    /// The events of a guard accumulate, in intervals below `close` in s: writes the state in which they end to `x` and returns
    /// what happened.
    ///
    /// # Errors
    /// There is no such state: which events accumulate, and the way out.
    fn rest(&mut self, _index: usize, _at: &Instant<'_, S>, _close: f64, _x: &mut [S]) -> Result<&str, String> {
        Err("a mode of the model changes to and fro without end".to_owned())
    }

    /// The typical size of a state, in its unit; `None` where only the simulation tells it.
    fn scale(&self, _state: usize) -> Option<f64> {
        None
    }

    /// Inputs or forces jumped, also called once at the start: finds the mode.
    fn settle(&mut self, _at: &Instant<'_, S>) {}
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
