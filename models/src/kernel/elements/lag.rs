//! A first-order lag.

use mops_core::Scalar;

/// `T y' = u - y`: the output of `1/(T s + 1)` is its own state.
#[derive(Debug, Clone, Copy)]
pub struct Lag<S> {
    /// Time constant `T`, s, positive.
    pub time: S,
}

impl<S: Scalar> Lag<S> {
    /// `y'` for input `u` and state `y`.
    #[inline]
    pub fn derivative(&self, u: S, y: S) -> S {
        (u - y) / self.time
    }
}
