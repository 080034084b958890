//! Clocks of a user's model: sampled memory that changes at fixed instants.

use mops_core::Instant;
use mops_language::Scalar;

use super::bank::Bank;
use super::running::Running;
use crate::kernel::{is_due, latest};

impl<S: Scalar, B: Bank<S>> Running<'_, S, B> {
    /// Changes the memory of all clocks that are due. Values that were computed earlier reach the memory before it is
    /// read.
    pub(super) fn tick(&mut self, at: &Instant<'_, S>, x: &mut [S]) {
        let model = self.model;
        for ((clock, _), ticking) in model.clocks.iter().zip(&mut self.ticking) {
            if let Some((_, values)) = ticking.pending.take_if(|(time, _)| is_due(*time, at.t)) {
                x[clock.memory.clone()].copy_from_slice(&values);
            }
        }
        let ticking = self.ticking.iter_mut().zip(&model.clocks);
        let arrivals: Vec<Option<f64>> = ticking.map(|(ticking, (clock, _))| ticking.tick(clock, at.t)).collect();
        if arrivals.iter().all(Option::is_none) {
            return;
        }
        let before = x.to_vec();
        let before = Instant { x: &before, ..*at };
        self.settle_modes(&before);
        for (k, ((clock, next), arrival)) in model.clocks.iter().zip(arrivals).enumerate() {
            let Some(arrival) = arrival else { continue };
            let mut bank = self.bank.borrow_mut();
            self.load(&mut bank, &before);
            // A condition on the time is met at the instant itself, however the instant is rounded.
            bank.set(model.layout.time(), S::from(latest(at.t)));
            next.run(&mut *bank);
            let values = next.results.iter().map(|&register| bank.get(register));
            if arrival > at.t {
                self.ticking[k].pending = Some((arrival, values.collect()));
            } else {
                x[clock.memory.clone()].iter_mut().zip(values).for_each(|(x, value)| *x = value);
            }
        }
    }
}
