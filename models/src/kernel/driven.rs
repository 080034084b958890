//! Plant together with its inputs: the system that a simulation integrates.

use mops_core::{
    Failure, Instant, Plant,
    plant::{EventInstant, Stretch},
};
use mops_language::{Scalar, enclosure::Enclosure};

use super::attempt::Attempt;
use super::dormand_prince::DormandPrince;
use super::inputs::Inputs;
use super::instants::{common, next_of};
use super::integrable::Integrable;
use super::step::Step;

/// Plant with its inputs and the forces on it. The plant comes last so that it can be of any kind: `dyn Integrable`
/// too.
pub struct Driven<'a, S, P: ?Sized> {
    inputs: Inputs<'a, S>,
    /// State that each signal equals, if any; signals beyond are computed.
    shows: Vec<Option<usize>>,
    /// Derivatives of the time of the current events, with value 0.
    delay: S,
    has_started: bool,
    /// Plant.
    pub plant: P,
}

impl<'a, S: Scalar, P: Plant<S>> Driven<'a, S, P> {
    /// Combines the plant with its inputs; `shows` gives for each signal the state that it equals. Signals beyond the
    /// length of `shows` are computed.
    pub fn new(plant: P, mut inputs: Inputs<'a, S>, shows: &[Option<usize>]) -> Self {
        inputs.delay(|input| plant.dead_time(input));
        Self { inputs, shows: shows.to_vec(), delay: S::from(0.0), has_started: false, plant }
    }

    /// Combines a plant without inputs and forces.
    pub fn alone(plant: P) -> Self {
        Self::new(plant, Inputs::new(Vec::new(), 0), &[])
    }
}

impl<S: Scalar, P: Plant<S> + ?Sized> Driven<'_, S, P> {
    /// Returns the states at the start.
    ///
    /// # Errors
    /// The reason why the simulation cannot start.
    pub fn begin(&mut self) -> Result<Vec<S>, Failure> {
        let mut x = self.plant.start();
        self.recall(&mut x);
        self.inputs.arrive();
        let [u, w] = self.inputs_at(0.0);
        let before = x.clone();
        let at = Instant { t: self.inputs.time(0.0), x: &before, u: &u, w: &w };
        self.plant.begin(&at, &mut x)?;
        let mut inputs = self.inputs.clone();
        inputs.pass_all(0.0);
        inputs.look(0.0, &x, |at| self.plant.can_start(at))?;
        Ok(x)
    }

    /// Passes on the past before the start: what is known of the inputs, as far back as it matters, with the states at
    /// rest.
    fn recall(&mut self, x: &mut [S]) {
        let Some(reach) = self.plant.memory().map(|memory| memory.reach()) else { return };
        let mut from = self.inputs.first_known().max(-reach);
        let is_known = from < 0.0 && from.is_finite();
        if is_known {
            self.inputs.pass_all(from);
        } else {
            self.inputs.arrive();
            from = 0.0;
        }
        let [u, w] = self.inputs_at(from);
        let before = x.to_vec();
        let at = Instant { t: self.inputs.time(from), x: &before, u: &u, w: &w };
        if let Some(memory) = self.plant.memory_mut() {
            memory.begin(&at, x);
        }
        while is_known && from < 0.0 {
            let to = self.inputs.next_break().min(0.0);
            if self.remembers() {
                self.remember(&Step::resting(x, [from, to]));
            }
            let inputs = &self.inputs;
            if let Some(memory) = self.plant.memory_mut() {
                let time = [from, to].map(|t| inputs.time(t));
                let at = |time: f64| inputs.at_event(inputs.since_start(time), S::from(0.0));
                let rate = |time: f64, input: usize| inputs.slope(input, inputs.since_start(time));
                memory.follow(&Stretch { time, x, at: &at, rate: &rate });
            }
            if to < 0.0 {
                self.jump_inputs(to, x);
            }
            from = to;
        }
    }

    /// Evaluates a function of the plant just before the start, at the states `start` and in its mode there; after
    /// [`Driven::begin`] and before a simulation.
    fn look_before<R>(&mut self, start: &[S], of: impl FnOnce(&Self, &Instant<'_, S>) -> R) -> R {
        let [u, w] = self.inputs_at(0.0);
        let at = Instant { t: self.inputs.time(0.0), x: start, u: &u, w: &w };
        self.plant.settle(&at);
        of(self, &at)
    }

    /// Returns signals just before the start; after [`Driven::begin`] and before a simulation.
    pub fn initial(&mut self, start: &[S], signals: &[usize]) -> Vec<S> {
        self.look_before(start, |of, at| {
            let signal =
                |&signal: &usize| of.shows(signal).map_or_else(|| of.plant.signal(signal, at), |state| start[state]);
            signals.iter().map(signal).collect()
        })
    }

    /// Returns the rate that a unit of each force adds to a state just before the start, given the state of each force;
    /// after
    /// [`Driven::begin`] and before a simulation.
    pub fn mobilities(&mut self, start: &[S], states: &[usize]) -> Vec<S> {
        self.look_before(start, |of, at| {
            states.iter().enumerate().map(|(force, &state)| mobility(&of.plant, at, force, state)).collect()
        })
    }

    /// Returns true if an input jumps at time 0.
    pub fn jumps_at_start(&self) -> bool {
        self.inputs.jumps_at_start()
    }

    /// Returns the time of the plant, s, at a time of the simulation.
    pub fn time(&self, t: f64) -> f64 {
        self.inputs.time(t)
    }

    /// Returns the inputs and the forces from outside at `t`.
    pub fn inputs_at(&self, t: f64) -> [Vec<S>; 2] {
        self.inputs.at_event(t, S::from(0.0))
    }

    pub(super) fn inputs(&self) -> &Inputs<'_, S> {
        &self.inputs
    }

    #[inline]
    pub(super) fn derivative(&self, t: f64, x: &[S], dx: &mut [S]) {
        self.inputs.look(t, x, |at| self.plant.rates(at, dx));
    }

    /// Returns the value of a signal, by its index in the interface, at the time `t`, s, and the states `x`.
    #[inline]
    pub fn signal(&self, signal: usize, t: f64, x: &[S]) -> S {
        self.inputs.look(t, x, |at| self.plant.signal(signal, at))
    }

    pub(super) fn guards(&self) -> usize {
        self.plant.events().map_or(0, |events| events.guards())
    }

    pub(super) fn guard_state(&self, index: usize) -> Option<(usize, f64)> {
        self.plant.events()?.guard_state(index)
    }

    pub(super) fn guard_rate(&self, index: usize, t: f64, x: &[S]) -> Option<f64> {
        let events = self.plant.events()?;
        self.inputs.with_rates(t, |du| self.inputs.look(t, x, |at| events.guard_rate(index, at, du)))
    }

    pub(super) fn switch(&mut self, index: usize, t: f64, x: &mut [S]) -> &str {
        let before = x.to_vec();
        let [u, w] = self.inputs.at_event(t, self.delay);
        let at = Instant { t: self.inputs.time(t), x: &before, u: &u, w: &w };
        let Some(events) = self.plant.events_mut() else { return "" };
        let inputs = &self.inputs;
        events.switch(index, &EventInstant { at, du: &|input| inputs.slope(input, t), delay: self.delay }, x)
    }

    pub(super) fn rest(&mut self, index: usize, t: f64, close: f64, x: &mut [S]) -> Result<&str, String> {
        let before = x.to_vec();
        let [u, w] = self.inputs.at_event(t, self.delay);
        let at = Instant { t: self.inputs.time(t), x: &before, u: &u, w: &w };
        let Some(events) = self.plant.events_mut() else { return Ok("") };
        let inputs = &self.inputs;
        events.rest(index, &EventInstant { at, du: &|input| inputs.slope(input, t), delay: self.delay }, close, x)
    }

    pub(super) fn has_bounds(&self) -> bool {
        self.plant.bounds().is_some()
    }

    pub(super) fn enclose_guard(&self, index: usize, time: Enclosure, x: &[Enclosure]) -> Enclosure {
        let Some(bounds) = self.plant.bounds() else { return Enclosure::UNKNOWN };
        self.inputs.over(time, x, |over| bounds.of_guard(index, over))
    }

    pub(super) fn enclose_signal(&self, signal: usize, time: Enclosure, x: &[Enclosure]) -> Enclosure {
        let Some(bounds) = self.plant.bounds() else { return Enclosure::UNKNOWN };
        self.inputs.over(time, x, |over| bounds.of_signal(signal, over))
    }

    /// Sets the derivatives of the time of the events that follow, with value 0: the time and the inputs that resets
    /// read move with the event.
    pub(super) fn delay_events(&mut self, delay: S) {
        self.delay = delay;
    }

    pub(super) fn shows(&self, signal: usize) -> Option<usize> {
        self.shows.get(signal).copied().flatten()
    }

    /// Returns the next time after `t`, s, at which an input jumps or the plant samples; infinity if none follows.
    pub(super) fn next_break(&self, t: f64) -> f64 {
        let of_inputs = self.inputs.next_break();
        let Some(breaks) = self.plant.breaks() else { return of_inputs };
        next_of([of_inputs, self.inputs.since_start(breaks.next(self.inputs.time(t)))].into_iter())
    }

    pub(super) fn longest_step(&self) -> f64 {
        self.inputs.longest_step().min(self.plant.longest_step())
    }

    pub(super) fn jacobian_pattern(&self) -> Option<Vec<(usize, usize)>> {
        self.plant.jacobian().map(|jacobian| jacobian.pattern())
    }

    pub(super) fn jacobian(&self, t: f64, x: &[S], entry: &mut dyn FnMut(usize, usize, f64)) -> bool {
        let Some(jacobian) = self.plant.jacobian() else { return false };
        self.inputs.look(t, x, |at| jacobian.entries(at, entry))
    }

    /// Returns true if quantities are delayed: [`Driven::remember`] is to be called for accepted steps.
    pub(super) fn remembers(&self) -> bool {
        self.plant.memory().is_some_and(|memory| !memory.delays().is_empty())
    }

    /// Handles a break, and is called once at the start: inputs take their new values, then the plant passes its own
    /// breaks. Returns the derivatives of the time of the break along the directions of the scalar, with value 0.
    pub(super) fn pass_break(&mut self, t: f64, x: &mut [S]) -> S {
        let of_inputs = self.jump_inputs(t, x);
        self.inputs.settle(t);
        let mut moves = of_inputs.unwrap_or(S::from(0.0));
        if let Some(breaks) = self.plant.breaks_mut() {
            let before = x.to_vec();
            let own = self.inputs.look(t, &before, |at| breaks.pass(at, x));
            moves = match of_inputs.filter(|_| own.tangents().iter().any(|&tangent| tangent != 0.0)) {
                Some(of_inputs) => common(of_inputs, own),
                None => of_inputs.unwrap_or(own),
            };
        }
        let has_started = std::mem::replace(&mut self.has_started, true);
        let plant = &mut self.plant;
        self.inputs.look(t, x, |at| {
            plant.settle(at);
            if !has_started && let Some(events) = plant.events_mut() {
                events.arm(at);
            }
        });
        moves
    }

    /// Lets the inputs jump that do so at `t`: those without a dead time, then each of the others at its own time.
    /// Returns the derivatives of the time of the latter.
    fn jump_inputs(&mut self, t: f64, x: &mut [S]) -> Option<S> {
        if self.inputs.jumps_at(t) {
            self.jump(t, x, S::from(0.0), |inputs| inputs.pass(t));
        }
        let mut moves: Option<S> = None;
        while let Some((k, late)) = self.inputs.late_at(t) {
            self.jump(t, x, late, |inputs| inputs.pass_late(k));
            moves = Some(moves.map_or(late, |moves| common(moves, late)));
        }
        moves
    }

    /// Passes a jump of inputs whose time has the derivatives `late`: the state moves along the rates before the jump,
    /// and back along those after it.
    fn jump(&mut self, t: f64, x: &mut [S], late: S, pass: impl FnOnce(&mut Inputs<'_, S>)) {
        let moves = late.tangents().iter().any(|&tangent| tangent != 0.0);
        let mut rates = if moves { x.to_vec() } else { Vec::new() };
        if moves {
            shift(self, t, x, &mut rates, late);
        }
        let before = self.plant.memory().is_some().then(|| {
            let slopes: Vec<f64> = (0..self.inputs.len()).map(|input| self.inputs.slope(input, t)).collect();
            (self.inputs.at_event(t, late), slopes)
        });
        pass(&mut self.inputs);
        if let Some(([u, w], slopes)) = before
            && let Some(memory) = self.plant.memory_mut()
        {
            let inputs = &self.inputs;
            let [u_after, w_after] = inputs.at_event(t, late);
            let before = Instant { t: inputs.time(t), x, u: &u, w: &w };
            let after = Instant { u: &u_after, w: &w_after, ..before };
            memory.jump(
                &EventInstant { at: before, du: &|input| slopes[input], delay: late },
                &EventInstant { at: after, du: &|input| inputs.slope(input, t), delay: late },
            );
        }
        if moves {
            shift(self, t, x, &mut rates, -late);
        }
    }
}

impl<S: Scalar, P: Integrable<S> + ?Sized> Driven<'_, S, P> {
    pub(super) fn signal_at(&self, signal: usize, times: &[f64; 5], states: &[Vec<S>; 5]) -> [S; 5] {
        self.plant.signals(&self.inputs, signal, times, states)
    }

    pub(super) fn guard(&self, index: usize, t: f64, x: &[S]) -> S {
        self.plant.guard(&self.inputs, index, t, x)
    }

    pub(super) fn guard_at(&self, index: usize, times: &[f64; 3], states: &[Vec<S>; 3]) -> [S; 3] {
        self.plant.guards(&self.inputs, index, times, states)
    }

    pub(super) fn attempt(&self, method: &mut DormandPrince<S>, at: Attempt<'_, S>, next: &mut [S]) -> f64 {
        self.plant.attempt(&self.inputs, method, at, next)
    }
}

/// Returns the rate that a unit of a force adds to a state.
pub(crate) fn mobility<S: Scalar>(
    plant: &(impl Plant<S> + ?Sized),
    at: &Instant<'_, S>,
    force: usize,
    state: usize,
) -> S {
    let rate = |unit: f64| {
        let (mut w, mut rates) = (at.w.to_vec(), at.x.to_vec());
        w[force] = S::from(unit);
        plant.rates(&Instant { w: &w, ..*at }, &mut rates);
        rates[state]
    };
    rate(1.0) - rate(0.0)
}

/// Moves the state by `delay` along its derivative, to first order; the value of the state does not change.
pub(crate) fn shift<S: Scalar, P: Plant<S> + ?Sized>(
    f: &Driven<'_, S, P>,
    t: f64,
    x: &mut [S],
    dx: &mut [S],
    delay: S,
) {
    if S::DIRECTIONS > 0 {
        f.derivative(t, x, dx);
        for (x, dx) in x.iter_mut().zip(dx.iter()) {
            *x += *dx * delay;
        }
    }
}
