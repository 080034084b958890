//! Clocks of a user's model: sampled memory that changes at fixed instants.

use mops_core::Instant;
use mops_language::Scalar;

use super::bank::Bank;
use super::compiled::Clock;
use super::running::Running;
use crate::kernel::{is_due, latest};

/// Progress of a clock.
#[derive(Debug, Clone)]
pub(super) struct Ticking<S> {
    /// Number of the next instant; `None` before the start of the simulation.
    next: Option<f64>,
    /// Computed values that have not reached the memory yet, and the time at which they do, s.
    pending: Option<(f64, Vec<S>)>,
}

impl<S> Ticking<S> {
    pub(super) fn new() -> Self {
        Self { next: None, pending: None }
    }

    /// Begins at `t`, s, with the first instant from then on: a simulation that begins in the middle of a record
    /// continues with the phase of its clock. Returns the time at which the values of the instant before it reach the
    /// memory, if that is later.
    fn begin(&mut self, clock: &Clock, t: f64) -> Option<f64> {
        let at = |number: f64| clock.offset + number * clock.period;
        // Rounding may have passed an instant that is due.
        let mut number = ((t - clock.offset) / clock.period - 0.5).floor().max(0.0);
        while !is_due(t, at(number)) {
            number += 1.0;
        }
        self.next = Some(number);
        let arrival = at(number - 1.0) + clock.delay;
        (number > 0.0 && !is_due(arrival, t)).then_some(arrival)
    }

    /// Returns the time of the next instant or change of the memory, s.
    pub(super) fn next_break(&self, clock: &Clock) -> f64 {
        let tick = clock.offset + self.next.unwrap_or(0.0) * clock.period;
        self.pending.as_ref().map_or(tick, |(at, _)| at.min(tick))
    }

    /// Returns the time at which computed values reach the memory, if an instant is due at `t`, and moves on to the
    /// next one.
    fn tick(&mut self, clock: &Clock, t: f64) -> Option<f64> {
        let Some(next) = self.next else { return self.begin(clock, t).or_else(|| self.tick(clock, t)) };
        let is_due = is_due(clock.offset + next * clock.period, t);
        self.next = Some(next + f64::from(u8::from(is_due)));
        is_due.then_some(t + clock.delay)
    }
}

impl<S: Scalar, B: Bank<S>> Running<'_, S, B> {
    /// Changes the memory of all clocks that are due. Values that were computed earlier reach the memory before it is
    /// read.
    pub(super) fn tick(&mut self, at: &Instant<'_, S>, x: &mut [S]) {
        let model = self.model;
        for (clock, ticking) in model.clocks.iter().zip(&mut self.ticking) {
            if let Some((_, values)) = ticking.pending.take_if(|(time, _)| is_due(*time, at.t)) {
                x[clock.memory.clone()].copy_from_slice(&values);
            }
        }
        let ticking = self.ticking.iter_mut().zip(&model.clocks);
        let arrivals: Vec<Option<f64>> = ticking.map(|(ticking, clock)| ticking.tick(clock, at.t)).collect();
        if arrivals.iter().all(Option::is_none) {
            return;
        }
        let before = x.to_vec();
        let before = Instant { x: &before, ..*at };
        self.settle_modes(&before);
        for (k, (clock, arrival)) in model.clocks.iter().zip(arrivals).enumerate() {
            let Some(arrival) = arrival else { continue };
            let mut bank = self.bank.borrow_mut();
            self.load(&mut bank, &before);
            // A condition on the time is met at the instant itself, however the instant is rounded.
            bank.set(model.layout.time(), S::from(latest(at.t)));
            clock.next.run(&mut *bank);
            let values = clock.next.results.iter().map(|&register| bank.get(register));
            if arrival > at.t {
                self.ticking[k].pending = Some((arrival, values.collect()));
            } else {
                x[clock.memory.clone()].iter_mut().zip(values).for_each(|(x, value)| *x = value);
            }
        }
    }
}
