//! Dead zone of a signal.

use mops_language::Scalar;

use super::band::{Band, Region};

/// Dead zone: `y = u - high` above the zone, `u - low` below it, 0 within.
#[derive(Debug, Clone, Copy)]
pub struct DeadZone<S> {
    band: Band<S>,
}

impl<S: Scalar> DeadZone<S> {
    /// Creates a dead zone from `low` to `high`.
    pub fn new(low: S, high: S) -> Self {
        Self { band: Band::new(low, high) }
    }

    /// Returns the output in the current mode.
    #[inline]
    pub fn output(&self, u: S) -> S {
        match self.band.region {
            Region::Below => u - self.band.low,
            Region::Within => S::from(0.0),
            Region::Above => u - self.band.high,
        }
    }

    /// Returns the guard: not negative while the mode is active.
    #[inline]
    pub fn guard(&self, u: S) -> S {
        self.band.guard(u)
    }

    /// Switches the mode after the guard became negative. Returns true if the input is now outside the zone.
    pub fn switch(&mut self, u: S) -> bool {
        self.band.switch(u);
        self.band.region != Region::Within
    }

    /// Finds the mode for the input `u`.
    pub fn settle(&mut self, u: S) {
        self.band.settle(u);
    }
}
