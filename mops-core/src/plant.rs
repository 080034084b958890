//! Plants: the equations of a model at given parameters, with inputs and forces as arguments.

use crate::enclosure::Enclosure;
use crate::failure::Failure;
use crate::linear::Clock;
use crate::scalar::{Dual7, Scalar};

/// Time, states, inputs and forces at which a plant is evaluated.
#[derive(Debug, Clone, Copy)]
pub struct Instant<'a, S> {
    /// Time, s.
    pub t: f64,
    /// The states, in the order of [`crate::Model::equation_states`].
    pub x: &'a [S],
    /// The inputs as they reach the plant, in the order of [`crate::Interface::inputs`].
    pub u: &'a [S],
    /// Additive terms of the right-hand sides, one for every [`crate::Port::Process`] in the order of
    /// [`crate::Interface::ports`]; 0 in the nominal model.
    pub w: &'a [S],
}

/// The instant of an event and its derivatives with respect to the parameters.
#[derive(Debug, Clone, Copy)]
pub struct EventInstant<'a, S> {
    /// Time, states, inputs and forces just before the event; the inputs vary with the event time.
    pub at: Instant<'a, S>,
    /// Rates of the inputs, per s.
    pub du: &'a [f64],
    /// Derivatives of the event time along the directions of the scalar; the value part is 0.
    pub delay: S,
}

/// Quantities over a part of an accepted step, see [`Plant::past`].
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

/// Value that a condition selects: of a limit, of `min` and `max`, of a piece of a curve.
#[derive(Debug, Clone)]
pub struct Selected<S> {
    /// Place, for a message.
    pub place: String,
    /// Value that acts.
    pub taken: S,
    /// Value that acts where the condition does not hold.
    pub other: S,
    /// Rates that the value acts on at once, by their states; then delayed quantities.
    pub rates: Vec<usize>,
}

/// A plant: `x' = f(t, x, u, w)` at given parameters, as a hybrid system whose guards switch between modes.
///
/// Implementations are generic over [`Scalar`]: they run with values and with exact tangents, including those of jumps at
/// events. The mode is the only state not contained in `x`. The mode changes in [`Plant::switch`], [`Plant::rest`],
/// [`Plant::settle`] and [`Plant::linearised_at`] alone; between mode changes the plant is smooth.
pub trait Plant<S: Scalar> {
    /// Returns the states at time 0.
    fn start(&self) -> Vec<S>;

    /// Checks that a simulation can start here.
    ///
    /// # Errors
    /// Returns the reason if the equations have no solution here or parameters contradict one another.
    fn can_start(&self, _at: &Instant<'_, S>) -> Result<(), Failure> {
        Ok(())
    }

    /// Writes `x'` in the current mode.
    fn rates(&self, at: &Instant<'_, S>, dx: &mut [S]);

    /// Returns the value of a signal, by its index in the interface. By default, the signals are the states, then the
    /// inputs.
    fn signal(&self, signal: usize, at: &Instant<'_, S>) -> S {
        at.x.get(signal).copied().unwrap_or_else(|| at.u[signal - at.x.len()])
    }

    /// Returns the number of guards in the current mode.
    fn guards(&self) -> usize {
        0
    }

    /// Returns the value of a guard: the mode is valid while the guard is not negative.
    fn guard(&self, _index: usize, _at: &Instant<'_, S>) -> S {
        S::from(1.0)
    }

    /// Returns the index and factor of the state that a guard is proportional to, such as the speed of a sliding joint. The
    /// event search then reads one state instead of all. `None` if the guard must be computed.
    fn guard_shows(&self, _index: usize) -> Option<(usize, f64)> {
        None
    }

    /// Returns the rate of a guard along the solution, per s; `du` are the rates of the inputs. `None` if only values of the
    /// guard are available.
    fn guard_rate(&self, _index: usize, _at: &Instant<'_, S>, _du: &[f64]) -> Option<f64> {
        None
    }

    /// Changes the mode after a guard became negative. If the state jumps, overwrites the state before the event in `x` with
    /// the state after it. Returns a description of the event, empty if users need not see it.
    fn switch(&mut self, _index: usize, _event: &EventInstant<'_, S>, _x: &mut [S]) -> &str {
        ""
    }

    /// Returns true if the plant provides bounds of its guards and signals.
    fn has_bounds(&self) -> bool {
        false
    }

    /// Returns bounds of a guard and of its rate over a time interval; called only if [`Plant::has_bounds`].
    fn enclose_guard(&self, _index: usize, _over: &Span<'_>) -> Enclosure {
        Enclosure::UNKNOWN
    }

    /// Returns bounds of a signal and of its rate over a time interval; called only if [`Plant::has_bounds`].
    fn enclose_signal(&self, _signal: usize, _over: &Span<'_>) -> Enclosure {
        Enclosure::UNKNOWN
    }

    /// Handles accumulating (Zeno) events of a guard, at intervals below `close` in s. Writes the limit state to `x` and
    /// returns a description.
    ///
    /// # Errors
    /// Returns an error if there is no limit state: which events accumulate, and how to avoid them. The simulation fails.
    fn rest(&mut self, _index: usize, _event: &EventInstant<'_, S>, _close: f64, _x: &mut [S]) -> Result<&str, String> {
        Err("a mode of the model chatters without end".to_owned())
    }

    /// Returns true if the plant depends on its past: [`Plant::begin`] and [`Plant::remember`] are to be called. They are not called
    /// for a model with effects, so that such a plant has no ports.
    fn remembers(&self) -> bool {
        false
    }

    /// Returns the quantities on whose past the plant depends.
    fn past(&self, _at: &Instant<'_, S>) -> Vec<S> {
        Vec::new()
    }

    /// Returns the times by which these quantities are delayed, s.
    fn delays(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Returns the clocks of the plant, if a linearisation can treat them.
    fn clocks(&self) -> Vec<Clock> {
        Vec::new()
    }

    /// Writes the changes of the memory of all clocks at an instant of each, its next value minus the present one.
    fn changes(&self, _at: &Instant<'_, S>, _dx: &mut [S]) {}

    /// Takes the past as constant, with these values of the quantities.
    fn hold(&mut self, _past: &[S]) {}

    /// Takes the past as constant: `at` is the start, with the inputs just before it; for inputs that are known before, the beginning of
    /// what is known. [`Plant::remember`] then stores the rest of the past, with the states at rest.
    fn begin(&mut self, _at: &Instant<'_, S>) {}

    /// Stores the quantities of [`Plant::past`] over a part of an accepted step, or returns false if the quartic through their
    /// values is not accurate enough: the part is then halved.
    fn remember(&mut self, _over: &Past<'_, S>) -> bool {
        true
    }

    /// Returns true if [`Plant::sample`] is to be called. It is not called for a model with effects, so that such a plant has no
    /// ports.
    fn samples(&self) -> bool {
        false
    }

    /// Samples: at the start, at each break of the plant, and at jumps of inputs or forces, before [`Plant::settle`]. States that
    /// jump get their new values in `x`; `at` has those before. Returns the derivatives of the time of a break of the plant along the
    /// directions of the scalar, with value 0.
    fn sample(&mut self, _at: &Instant<'_, S>, _x: &mut [S]) -> S {
        S::from(0.0)
    }

    /// Determines the mode: at the start, at each break of the plant, and at jumps of inputs or forces.
    fn settle(&mut self, _at: &Instant<'_, S>) {}

    /// Enters the mode for linearisation. If `at_rest`, at an equilibrium or during the search for one, no joint has dry
    /// friction. Otherwise dry friction is omitted only for joints with practically zero speed; the others slide in their
    /// direction of motion. Returns the positions, as states, of the joints without dry friction.
    ///
    /// # Errors
    /// Returns an error if the plant has no linearisation.
    fn linearised_at(&mut self, at: &Instant<'_, S>, _at_rest: bool) -> Result<Vec<usize>, Failure> {
        self.settle(at);
        Ok(Vec::new())
    }

    /// Returns the values that conditions select at a point. The mode for linearisation was entered.
    fn selected(&self, _at: &Instant<'_, S>) -> Vec<Selected<S>> {
        Vec::new()
    }

    /// Returns the limit beyond which a point lies, if the plant is linearised within its limits all the same.
    fn exceeded(&self, _at: &Instant<'_, S>) -> Option<&'static str> {
        None
    }

    /// Returns the typical magnitude of a state, in its unit; `None` if only the simulation can determine it.
    fn scale(&self, _state: usize) -> Option<f64> {
        None
    }

    /// Returns the next time after `t` at which the plant itself samples or jumps, s; infinity if never.
    fn next_break(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Returns the largest step size that resolves the plant, s. The limit is needed because a state at rest does not limit
    /// the step size.
    fn longest_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Returns the sparsity pattern of the Jacobian `df/dx` as pairs of row and column; `None` for a dense one. The stiff
    /// method uses the band spanned by the pattern.
    fn jacobian_pattern(&self) -> Option<Vec<(usize, usize)>> {
        None
    }

    /// Passes each entry of the Jacobian `df/dx` as row, column and value to `entry` and returns `true`. Returns `false` if
    /// there is no exact Jacobian; finite differences are then used.
    fn jacobian(&self, _at: &Instant<'_, S>, _entry: &mut dyn FnMut(usize, usize, f64)) -> bool {
        false
    }

    /// Returns the failure, with an explanation specific to this plant if there is one.
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
    fn enclose_signal(&self, signal: usize, over: &Span<'_>) -> Enclosure {
        (**self).enclose_signal(signal, over)
    }
    fn rest(&mut self, index: usize, event: &EventInstant<'_, S>, close: f64, x: &mut [S]) -> Result<&str, String> {
        (**self).rest(index, event, close, x)
    }
    fn remembers(&self) -> bool {
        (**self).remembers()
    }
    fn begin(&mut self, at: &Instant<'_, S>) {
        (**self).begin(at)
    }
    fn past(&self, at: &Instant<'_, S>) -> Vec<S> {
        (**self).past(at)
    }
    fn delays(&self) -> Vec<f64> {
        (**self).delays()
    }
    fn clocks(&self) -> Vec<Clock> {
        (**self).clocks()
    }
    fn changes(&self, at: &Instant<'_, S>, dx: &mut [S]) {
        (**self).changes(at, dx);
    }
    fn hold(&mut self, past: &[S]) {
        (**self).hold(past)
    }
    fn remember(&mut self, over: &Past<'_, S>) -> bool {
        (**self).remember(over)
    }
    fn samples(&self) -> bool {
        (**self).samples()
    }
    fn sample(&mut self, at: &Instant<'_, S>, x: &mut [S]) -> S {
        (**self).sample(at, x)
    }
    fn settle(&mut self, at: &Instant<'_, S>) {
        (**self).settle(at)
    }
    fn linearised_at(&mut self, at: &Instant<'_, S>, at_rest: bool) -> Result<Vec<usize>, Failure> {
        (**self).linearised_at(at, at_rest)
    }
    fn selected(&self, at: &Instant<'_, S>) -> Vec<Selected<S>> {
        (**self).selected(at)
    }
    fn exceeded(&self, at: &Instant<'_, S>) -> Option<&'static str> {
        (**self).exceeded(at)
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
    /// Returns the plant at the given parameter values.
    ///
    /// # Errors
    /// Returns an error if the model is not defined for the parameters.
    fn open<'a>(&'a self, parameters: &'a [f64]) -> Result<Box<dyn Plant<f64> + 'a>, Failure>;

    /// Returns the plant with tangents, at parameter values with tangents.
    ///
    /// # Errors
    /// Returns an error as [`Open::open`] does.
    fn open_dual<'a>(&'a self, parameters: &'a [Dual7]) -> Result<Box<dyn Plant<Dual7> + 'a>, Failure>;

    /// Returns the accuracy and the limits of simulations of the model.
    fn tolerance(&self) -> crate::Tolerance;
}

/// Scalar type of effects and opened models: a number, or a number with tangents.
pub trait Opening: Scalar {
    /// Calls [`Open::open`] or [`Open::open_dual`].
    ///
    /// # Errors
    /// Returns an error as these functions do.
    fn open<'a>(model: &'a dyn Open, parameters: &'a [Self]) -> Result<Box<dyn Plant<Self> + 'a>, Failure>;

    /// Calls [`crate::Effect::bind`] or [`crate::Effect::bind_dual`].
    fn bind(effect: &dyn crate::Effect, parameters: &[Self]) -> Box<dyn crate::BoundEffect<Self>>;
}

impl Opening for f64 {
    fn open<'a>(model: &'a dyn Open, parameters: &'a [Self]) -> Result<Box<dyn Plant<Self> + 'a>, Failure> {
        model.open(parameters)
    }
    fn bind(effect: &dyn crate::Effect, parameters: &[Self]) -> Box<dyn crate::BoundEffect<Self>> {
        effect.bind(parameters)
    }
}

impl Opening for Dual7 {
    fn open<'a>(model: &'a dyn Open, parameters: &'a [Self]) -> Result<Box<dyn Plant<Self> + 'a>, Failure> {
        model.open_dual(parameters)
    }
    fn bind(effect: &dyn crate::Effect, parameters: &[Self]) -> Box<dyn crate::BoundEffect<Self>> {
        effect.bind_dual(parameters)
    }
}
