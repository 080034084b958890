//! Plant together with its inputs.

use std::cell::RefCell;

use mops_core::enclosure::Enclosure;
use mops_core::{EventInstant, Failure, Instant, Plant, Scalar, Span};

use super::drive::Drive;
use super::{Dynamics, Step, next_of, remember};

/// Plant with given inputs and without external forces: the system that a simulation integrates.
pub struct Driven<'a, S, P> {
    /// Plant.
    pub plant: P,
    drives: Vec<Drive<'a, S>>,
    /// Inputs since the last break, if all of them are constant up to the next.
    constant: Option<Vec<S>>,
    /// Inputs at the time of the last evaluation.
    inputs: RefCell<Vec<S>>,
    /// Bounds of inputs and forces, to enclose guards.
    bounds: RefCell<Vec<Enclosure>>,
    /// External forces: all 0.
    forces: Vec<S>,
    /// Index of the state that each signal equals, if any.
    shows: &'a [Option<usize>],
    /// Delay of the current events: tangents with zero value.
    delay: S,
    /// True from the start of the simulation on.
    has_started: bool,
}

impl<'a, S: Scalar, P: Plant<S>> Driven<'a, S, P> {
    /// Combines the plant with its inputs, in the order of [`mops_core::Interface::inputs`]. `forces` is the number of
    /// external forces; `shows` gives for each signal the state that it equals. Signals beyond the length of `shows`
    /// are computed.
    pub fn new(plant: P, drives: Vec<Drive<'a, S>>, forces: usize, shows: &'a [Option<usize>]) -> Self {
        let zero = S::from(0.0);
        let inputs = RefCell::new(vec![zero; drives.len()]);
        let bounds = RefCell::default();
        Self {
            plant,
            drives,
            constant: None,
            inputs,
            bounds,
            forces: vec![zero; forces],
            shows,
            delay: zero,
            has_started: false,
        }
    }

    /// Passes on the past before the start at `t`: what is known of the inputs, as far back as the delays of the plant reach, with the
    /// states at rest.
    fn recall(&mut self, t: f64, x: &[S]) {
        let reach: f64 = self.plant.delays().iter().sum();
        let known = self.drives.iter().map(Drive::first_known).fold(t, f64::min);
        let mut from = known.max(t - reach);
        if from >= t || !from.is_finite() {
            let u: Vec<S> = self.drives.iter().map(Drive::before).collect();
            self.plant.begin(&Instant { t, x, u: &u, w: &self.forces });
            return;
        }
        self.constant = None;
        self.drives.iter_mut().for_each(|drive| drive.pass_break(from));
        let u: Vec<S> = self.drives.iter().map(|drive| drive.at(from)).collect();
        self.plant.begin(&Instant { t: from, x, u: &u, w: &self.forces });
        while from < t {
            let to = next_of(self.drives.iter().map(|drive| drive.next_break(from))).min(t);
            self.accepted(&Step::resting(x, [from, to]));
            self.drives.iter_mut().for_each(|drive| drive.pass_break(to));
            from = to;
        }
    }

    /// Evaluates a function of the plant at a time and a state.
    #[inline(always)]
    fn look<R>(&self, t: f64, x: &[S], at: impl FnOnce(&P, &Instant<'_, S>) -> R) -> R {
        if let Some(u) = &self.constant {
            return at(&self.plant, &Instant { t, x, u, w: &self.forces });
        }
        let mut inputs = self.inputs.borrow_mut();
        self.take_inputs(t, &mut inputs);
        at(&self.plant, &Instant { t, x, u: &inputs, w: &self.forces })
    }

    /// Evaluates bounds by the plant over a time span in which the states stay within `x`.
    fn over(&self, time: Enclosure, x: &[Enclosure], bounds_of: impl FnOnce(&P, &Span<'_>) -> Enclosure) -> Enclosure {
        let mut bounds = self.bounds.borrow_mut();
        bounds.clear();
        bounds.extend(self.drives.iter().map(|drive| drive.enclose(time)));
        bounds.resize(self.drives.len() + self.forces.len(), Enclosure::from(0.0));
        let (u, w) = bounds.split_at(self.drives.len());
        bounds_of(&self.plant, &Span { time, x, u, w })
    }

    #[inline(always)]
    fn take_inputs(&self, t: f64, inputs: &mut [S]) {
        for (u, drive) in inputs.iter_mut().zip(&self.drives) {
            *u = drive.at(t);
        }
    }

    /// Checks that a simulation can start from these states at time 0.
    ///
    /// # Errors
    /// The reason why it cannot.
    pub fn can_start(&self, x: &[S]) -> Result<(), Failure> {
        self.look(0.0, x, |plant, at| plant.can_start(at))
    }

    /// Returns true if an input jumps at time 0.
    pub fn jumps_at_start(&self) -> bool {
        self.drives.iter().any(Drive::jumps_at_start)
    }

    /// Returns signals just before time 0, given a plant that has not been simulated.
    pub fn initial(&self, mut plant: P, start: &[S], signals: &[usize]) -> Vec<S> {
        let u: Vec<S> = self.drives.iter().map(Drive::before).collect();
        let at = Instant { t: 0.0, x: start, u: &u, w: &self.forces };
        if plant.remembers() {
            plant.begin(&at);
        }
        plant.settle(&at);
        let signal =
            |&signal: &usize| self.shows[signal].map_or_else(|| plant.signal(signal, &at), |state| start[state]);
        signals.iter().map(signal).collect()
    }

    fn rates_of_inputs(&self, t: f64) -> Vec<f64> {
        self.drives.iter().map(|drive| drive.slope(t)).collect()
    }

    /// Applies a change to the plant at an event.
    fn at_event<'p, R>(&'p mut self, t: f64, x: &[S], change: impl FnOnce(&'p mut P, &EventInstant<'_, S>) -> R) -> R {
        let du = self.rates_of_inputs(t);
        let moved = |(drive, rate): (&Drive<'_, S>, &f64)| match S::DIRECTIONS {
            0 => drive.at(t),
            _ => drive.at(t) + self.delay * *rate,
        };
        let u: Vec<S> = self.drives.iter().zip(&du).map(moved).collect();
        let at = Instant { t, x, u: &u, w: &self.forces };
        change(&mut self.plant, &EventInstant { at, du: &du, delay: self.delay })
    }
}

impl<S: Scalar, P: Plant<S>> Dynamics<S> for Driven<'_, S, P> {
    // Written out because closures are not inlined into the stages.
    #[inline(always)]
    fn derivative(&self, t: f64, x: &[S], dx: &mut [S]) {
        if let Some(u) = &self.constant {
            return self.plant.rates(&Instant { t, x, u, w: &self.forces }, dx);
        }
        let mut inputs = self.inputs.borrow_mut();
        self.take_inputs(t, &mut inputs);
        self.plant.rates(&Instant { t, x, u: &inputs, w: &self.forces }, dx);
    }

    #[inline(always)]
    fn signal(&self, signal: usize, t: f64, x: &[S]) -> S {
        self.look(t, x, |plant, at| plant.signal(signal, at))
    }

    fn guards(&self) -> usize {
        self.plant.guards()
    }

    #[inline]
    fn guard(&self, index: usize, t: f64, x: &[S]) -> S {
        self.look(t, x, |plant, at| plant.guard(index, at))
    }

    fn guard_shows(&self, index: usize) -> Option<(usize, f64)> {
        self.plant.guard_shows(index)
    }

    fn guard_rate(&self, index: usize, t: f64, x: &[S]) -> Option<f64> {
        let du = self.rates_of_inputs(t);
        self.look(t, x, |plant, at| plant.guard_rate(index, at, &du))
    }

    fn switch(&mut self, index: usize, t: f64, x: &mut [S]) -> &str {
        let before = x.to_vec();
        self.at_event(t, &before, |plant, event| plant.switch(index, event, x))
    }

    fn has_bounds(&self) -> bool {
        self.plant.has_bounds()
    }

    fn enclose_guard(&self, index: usize, time: Enclosure, x: &[Enclosure]) -> Enclosure {
        self.over(time, x, |plant, span| plant.enclose_guard(index, span))
    }

    fn enclose_signal(&self, signal: usize, time: Enclosure, x: &[Enclosure]) -> Enclosure {
        self.over(time, x, |plant, span| plant.enclose_signal(signal, span))
    }

    fn rest(&mut self, index: usize, t: f64, close: f64, x: &mut [S]) -> Result<&str, String> {
        let before = x.to_vec();
        self.at_event(t, &before, |plant, event| plant.rest(index, event, close, x))
    }

    fn scale(&self, state: usize) -> Option<f64> {
        self.plant.scale(state)
    }

    fn delay_events(&mut self, delay: S) {
        self.delay = delay;
    }

    fn shows(&self, signal: usize) -> Option<usize> {
        self.shows.get(signal).copied().flatten()
    }

    fn next_break(&self, t: f64) -> f64 {
        let of_inputs = self.drives.iter().map(|drive| drive.next_break(t));
        next_of(of_inputs.chain(std::iter::once_with(|| self.plant.next_break(t))))
    }

    fn longest_step(&self) -> f64 {
        self.drives.iter().map(Drive::longest_step).fold(self.plant.longest_step(), f64::min)
    }

    fn jacobian_pattern(&self) -> Option<Vec<(usize, usize)>> {
        self.plant.jacobian_pattern()
    }

    fn jacobian(&self, t: f64, x: &[S], entry: &mut dyn FnMut(usize, usize, f64)) -> bool {
        self.look(t, x, |plant, at| plant.jacobian(at, entry))
    }

    fn remembers(&self) -> bool {
        self.plant.remembers()
    }

    fn accepted(&mut self, step: &Step<S>) {
        let past = |of: &Self, t: f64, x: &[S]| of.look(t, x, |plant, at| plant.past(at));
        remember(self, step, &past, &|of, over| of.plant.remember(over));
    }

    fn pass_break(&mut self, t: f64, x: &mut [S]) -> S {
        if !std::mem::replace(&mut self.has_started, true) && self.plant.remembers() {
            self.recall(t, x);
        }
        self.drives.iter_mut().for_each(|drive| drive.pass_break(t));
        let mut inputs = self.inputs.borrow_mut();
        self.take_inputs(t, &mut inputs);
        self.constant = self.drives.iter().all(Drive::is_constant).then(|| inputs.clone());
        let mut moves = S::from(0.0);
        if self.plant.samples() {
            let before = x.to_vec();
            moves = self.plant.sample(&Instant { t, x: &before, u: &inputs, w: &self.forces }, x);
        }
        self.plant.settle(&Instant { t, x, u: &inputs, w: &self.forces });
        moves
    }
}
