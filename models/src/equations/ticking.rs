//! Progress of the clocks of a user's model.

use mops_linear::Clock;

use crate::kernel::is_due;

/// Progress of a clock.
#[derive(Debug, Clone)]
pub(super) struct Ticking<S> {
    /// Number of the next instant; `None` before the start of the simulation.
    pub(super) next: Option<f64>,
    /// Computed values that have not reached the memory yet, and the time at which they do, s.
    pub(super) pending: Option<(f64, Vec<S>)>,
}

impl<S> Ticking<S> {
    pub(super) fn new() -> Self {
        Self { next: None, pending: None }
    }

    /// Begins at `t`, s, with the first instant from then on: a simulation that begins in the middle of a record
    /// continues with the phase of its clock. Returns the time at which the values of the instant before it reach the
    /// memory, if that is later.
    pub(super) fn begin(&mut self, clock: &Clock, t: f64) -> Option<f64> {
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
    pub(super) fn tick(&mut self, clock: &Clock, t: f64) -> Option<f64> {
        let Some(next) = self.next else { return self.begin(clock, t).or_else(|| self.tick(clock, t)) };
        let is_due = is_due(clock.offset + next * clock.period, t);
        self.next = Some(next + f64::from(u8::from(is_due)));
        is_due.then_some(t + clock.delay)
    }
}
