//! A limit on a signal.

use mops_core::Scalar;

use super::band::{Band, Region};

/// `y = min(max(u, low), high)`.
#[derive(Debug, Clone, Copy)]
pub struct Saturation<S> {
    band: Band<S>,
}

impl<S: Scalar> Saturation<S> {
    /// A limit from `low` to `high`.
    pub fn new(low: S, high: S) -> Self {
        Self { band: Band::new(low, high) }
    }

    /// The limited signal, in the present mode.
    #[inline]
    pub fn output(&self, u: S) -> S {
        match self.band.region {
            Region::Below => self.band.low,
            Region::Within => u,
            Region::Above => self.band.high,
        }
    }

    /// Not negative while the mode holds.
    #[inline]
    pub fn guard(&self, u: S) -> S {
        self.band.guard(u)
    }

    /// The guard became negative. Returns whether the limit now acts.
    pub fn switch(&mut self, u: S) -> bool {
        self.band.switch(u);
        self.band.region != Region::Within
    }

    /// Finds the mode from scratch.
    pub fn settle(&mut self, u: S) {
        self.band.settle(u);
    }
}
