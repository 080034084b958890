//! Saturation of a signal.

use mops_language::Scalar;

use super::band::{Band, Region};

/// Saturation `y = min(max(u, low), high)`.
#[derive(Debug, Clone, Copy)]
pub struct Saturation<S> {
    band: Band<S>,
}

impl<S: Scalar> Saturation<S> {
    /// Creates a saturation from `low` to `high`.
    pub fn new(low: S, high: S) -> Self {
        Self { band: Band::new(low, high) }
    }

    /// Returns the limited signal in the current mode.
    #[inline]
    pub fn output(&self, u: S) -> S {
        match self.band.region {
            Region::Below => self.band.low,
            Region::Within => u,
            Region::Above => self.band.high,
        }
    }

    /// Returns the guard: not negative while the mode is active.
    #[inline]
    pub fn guard(&self, u: S) -> S {
        self.band.guard(u)
    }

    /// Switches the mode after the guard became negative. Returns true if the limit is now active.
    pub fn switch(&mut self, u: S) -> bool {
        self.band.switch(u);
        self.band.region != Region::Within
    }

    /// Returns true if the input `u` is within the limits.
    pub fn holds(&self, u: S) -> bool {
        (self.band.low.value()..=self.band.high.value()).contains(&u.value())
    }

    /// Finds the mode for the input `u`.
    pub fn settle(&mut self, u: S) {
        self.band.settle(u);
    }
}
