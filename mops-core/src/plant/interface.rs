//! Interface of plants.

use mops_language::Scalar;

use super::instant::Instant;
use super::parts::{Bounds, Breaks, Events, Jacobian, Memory};
use crate::failure::Failure;

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

/// Dry friction omitted by a linearisation at a point, and the conditions under which the linearisation is valid there.
#[derive(Debug, Clone)]
pub struct LeftOut<S> {
    /// Positions, as states, of the joints without dry friction.
    pub frictionless: Vec<usize>,
    /// Values that conditions select.
    pub selected: Vec<Selected<S>>,
    /// Limit beyond which the point lies, if the plant is linearised within its limits all the same.
    pub exceeded: Option<&'static str>,
}

impl<S> Default for LeftOut<S> {
    fn default() -> Self {
        Self { frictionless: Vec::new(), selected: Vec::new(), exceeded: None }
    }
}

/// A plant: `x' = f(t, x, u, w)` at given parameters, as a hybrid system whose guards switch between modes.
///
/// Implementations are generic over [`Scalar`]: they run with values and with exact tangents, including those of jumps
/// at events. The mode is the only state not contained in `x`. The mode changes in [`Events::switch`],
/// [`Events::rest`],
/// [`Plant::settle`] and [`Plant::linearise`] alone; between mode changes the plant is smooth.
pub trait Plant<S: Scalar> {
    /// Returns the states at the start.
    fn start(&self) -> Vec<S>;

    /// Completes the states at the start by those that depend on the inputs; `at` has the inputs just before it.
    ///
    /// # Errors
    /// Returns the reason if there are no such states.
    fn begin(&mut self, _at: &Instant<'_, S>, _x: &mut [S]) -> Result<(), Failure> {
        Ok(())
    }

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

    /// Determines the mode: at the start, at each break of the plant, and at jumps of inputs or forces.
    fn settle(&mut self, _at: &Instant<'_, S>) {}

    /// Enters the mode for linearisation. If `at_rest`, at an equilibrium or during the search for one, no joint has
    /// dry friction. Otherwise dry friction is omitted only for joints with practically zero speed; the others slide in
    /// their direction of motion. By default the mode is that of a simulation.
    ///
    /// # Errors
    /// Returns an error if the plant has no linearisation.
    fn linearise(&mut self, at: &Instant<'_, S>, _at_rest: bool) -> Result<LeftOut<S>, Failure> {
        self.settle(at);
        Ok(LeftOut::default())
    }

    /// Returns the typical magnitude of a state, in its unit; `None` if only the simulation can determine it.
    fn scale(&self, _state: usize) -> Option<f64> {
        None
    }

    /// Returns the dead time of an input, s: its value reaches the plant this much later.
    fn dead_time(&self, _input: usize) -> Option<S> {
        None
    }

    /// Returns the largest step size that resolves the plant, s. The limit is needed because a state at rest does not
    /// limit the step size.
    fn longest_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Returns the largest step size at which an explicit method damps the fast decaying modes, s, where the error of a
    /// step does not show it: at rest no error limits the step, and the tangents grow.
    fn damped_step(&self) -> f64 {
        f64::INFINITY
    }

    /// Returns the failure, with an explanation specific to this plant if there is one.
    fn explain(&self, failure: Failure) -> Failure {
        failure
    }

    /// Returns the guards and events, if the plant has several modes.
    fn events(&self) -> Option<&dyn Events<S>> {
        None
    }

    /// Returns [`Plant::events`] to change the mode.
    fn events_mut(&mut self) -> Option<&mut dyn Events<S>> {
        None
    }

    /// Returns the instants at which the plant itself samples or jumps, if there are any.
    fn breaks(&self) -> Option<&dyn Breaks<S>> {
        None
    }

    /// Returns [`Plant::breaks`] to pass them.
    fn breaks_mut(&mut self) -> Option<&mut dyn Breaks<S>> {
        None
    }

    /// Returns the memory, if the plant depends on its past.
    fn memory(&self) -> Option<&dyn Memory<S>> {
        None
    }

    /// Returns [`Plant::memory`] to extend it.
    fn memory_mut(&mut self) -> Option<&mut dyn Memory<S>> {
        None
    }

    /// Returns the Jacobian or its pattern, if known; otherwise the stiff method uses finite differences of all
    /// entries.
    fn jacobian(&self) -> Option<&dyn Jacobian<S>> {
        None
    }

    /// Returns bounds of guards and signals, if available; otherwise they are sampled.
    fn bounds(&self) -> Option<&dyn Bounds> {
        None
    }
}

impl<S: Scalar, P: Plant<S> + ?Sized> Plant<S> for Box<P> {
    fn start(&self) -> Vec<S> {
        (**self).start()
    }
    fn begin(&mut self, at: &Instant<'_, S>, x: &mut [S]) -> Result<(), Failure> {
        (**self).begin(at, x)
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
    fn settle(&mut self, at: &Instant<'_, S>) {
        (**self).settle(at)
    }
    fn linearise(&mut self, at: &Instant<'_, S>, at_rest: bool) -> Result<LeftOut<S>, Failure> {
        (**self).linearise(at, at_rest)
    }
    fn scale(&self, state: usize) -> Option<f64> {
        (**self).scale(state)
    }
    fn dead_time(&self, input: usize) -> Option<S> {
        (**self).dead_time(input)
    }
    fn longest_step(&self) -> f64 {
        (**self).longest_step()
    }
    fn damped_step(&self) -> f64 {
        (**self).damped_step()
    }
    fn explain(&self, failure: Failure) -> Failure {
        (**self).explain(failure)
    }
    fn events(&self) -> Option<&dyn Events<S>> {
        (**self).events()
    }
    fn events_mut(&mut self) -> Option<&mut dyn Events<S>> {
        (**self).events_mut()
    }
    fn breaks(&self) -> Option<&dyn Breaks<S>> {
        (**self).breaks()
    }
    fn breaks_mut(&mut self) -> Option<&mut dyn Breaks<S>> {
        (**self).breaks_mut()
    }
    fn memory(&self) -> Option<&dyn Memory<S>> {
        (**self).memory()
    }
    fn memory_mut(&mut self) -> Option<&mut dyn Memory<S>> {
        (**self).memory_mut()
    }
    fn jacobian(&self) -> Option<&dyn Jacobian<S>> {
        (**self).jacobian()
    }
    fn bounds(&self) -> Option<&dyn Bounds> {
        (**self).bounds()
    }
}
