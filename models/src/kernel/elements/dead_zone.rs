//! A zone without response.

use mops_core::Scalar;

use super::band::{Band, Region};

/// `y = u - high` above the zone, `u - low` below it, 0 within.
#[derive(Debug, Clone, Copy)]
pub struct DeadZone<S> {
    band: Band<S>,
}

impl<S: Scalar> DeadZone<S> {
    /// A zone from `low` to `high`.
    pub fn new(low: S, high: S) -> Self {
        Self { band: Band::new(low, high) }
    }

    /// The response, in the present mode.
    #[inline]
    pub fn output(&self, u: S) -> S {
        match self.band.region {
            Region::Below => u - self.band.low,
            Region::Within => S::from(0.0),
            Region::Above => u - self.band.high,
        }
    }

    /// Not negative while the mode holds.
    #[inline]
    pub fn guard(&self, u: S) -> S {
        self.band.guard(u)
    }

    /// The guard became negative. Returns whether there is a response now.
    pub fn switch(&mut self, u: S) -> bool {
        self.band.switch(u);
        self.band.region != Region::Within
    }

    /// Finds the mode from scratch.
    pub fn settle(&mut self, u: S) {
        self.band.settle(u);
    }
}
