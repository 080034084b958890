//! Clocks of a user's model: sampled memory that changes at fixed instants.

use mops_core::{Instant, Scalar};

use super::bank::Bank;
use super::compiled::Clock;
use super::running::Running;
use crate::kernel::{is_due, latest};

/// Progress of a clock.
#[derive(Debug, Clone)]
pub(super) struct Ticking<S> {
    /// Number of the next instant.
    next: f64,
    /// Computed values that have not reached the memory yet, and the time at which they do, s.
    pending: Option<(f64, Vec<S>)>,
}

impl<S> Ticking<S> {
    pub(super) fn new() -> Self {
        Self { next: 0.0, pending: None }
    }

    /// Returns the time of the next instant or change of the memory, s.
    pub(super) fn next_break(&self, clock: &Clock) -> f64 {
        let tick = clock.offset + self.next * clock.period;
        self.pending.as_ref().map_or(tick, |(at, _)| at.min(tick))
    }

    /// Returns true if an instant is due at `t`, and moves on to the next one.
    fn ticks(&mut self, clock: &Clock, t: f64) -> bool {
        let is_due = is_due(clock.offset + self.next * clock.period, t);
        self.next += f64::from(u8::from(is_due));
        is_due
    }
}

impl<S: Scalar, B: Bank<S>> Running<'_, S, B> {
    /// Changes the memory of all clocks that are due. Values that were computed earlier reach the memory before it is read.
    pub(super) fn tick(&mut self, at: &Instant<'_, S>, x: &mut [S]) {
        let model = self.model;
        for (clock, ticking) in model.clocks.iter().zip(&mut self.ticking) {
            if let Some((_, values)) = ticking.pending.take_if(|(time, _)| is_due(*time, at.t)) {
                x[clock.memory.clone()].copy_from_slice(&values);
            }
        }
        let ticking = self.ticking.iter_mut().zip(&model.clocks);
        let due: Vec<bool> = ticking.map(|(ticking, clock)| ticking.ticks(clock, at.t)).collect();
        if !due.contains(&true) {
            return;
        }
        let before = x.to_vec();
        let before = Instant { x: &before, ..*at };
        self.settle_modes(&before);
        for (k, clock) in model.clocks.iter().enumerate().filter(|(k, _)| due[*k]) {
            let mut bank = self.bank.borrow_mut();
            self.load(&mut bank, &before);
            // A condition on the time is met at the instant itself, however the instant is rounded.
            bank.set(model.layout.time(), S::from(latest(at.t)));
            clock.next.run(&mut *bank);
            let values = clock.next.results.iter().map(|&register| bank.get(register));
            if clock.delay > 0.0 {
                self.ticking[k].pending = Some((at.t + clock.delay, values.collect()));
            } else {
                x[clock.memory.clone()].iter_mut().zip(values).for_each(|(x, value)| *x = value);
            }
        }
    }
}
