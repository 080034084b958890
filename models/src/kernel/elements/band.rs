//! Region of a value relative to a band: the modes that saturation and dead zone share.

use mops_language::Scalar;

/// Region of a value relative to a band.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Region {
    /// Below the band.
    Below,
    /// Within the band.
    Within,
    /// Above the band.
    Above,
}

/// Band from `low` to `high`, and the current region of the value.
#[derive(Debug, Clone, Copy)]
pub struct Band<S> {
    /// Lower end.
    pub low: S,
    /// Upper end, greater than the lower.
    pub high: S,
    /// Current region of the value.
    pub region: Region,
}

impl<S: Scalar> Band<S> {
    /// Creates a band, with the value within it.
    pub fn new(low: S, high: S) -> Self {
        Self { low, high, region: Region::Within }
    }

    /// Returns the guard: not negative while the value stays in its region.
    #[inline]
    pub fn guard(&self, value: S) -> S {
        match self.region {
            Region::Below => self.low - value,
            Region::Above => value - self.high,
            Region::Within if self.is_nearer_to_low(value) => value - self.low,
            Region::Within => self.high - value,
        }
    }

    /// Changes the region after the guard became negative.
    pub fn switch(&mut self, value: S) {
        self.region = match self.region {
            Region::Below | Region::Above => Region::Within,
            Region::Within if self.is_nearer_to_low(value) => Region::Below,
            Region::Within => Region::Above,
        };
    }

    /// Finds the region of a value.
    pub fn settle(&mut self, value: S) {
        let value = value.value();
        self.region = if value < self.low.value() {
            Region::Below
        } else if value > self.high.value() {
            Region::Above
        } else {
            Region::Within
        };
    }

    fn is_nearer_to_low(&self, value: S) -> bool {
        value.value() - self.low.value() < self.high.value() - value.value()
    }
}
