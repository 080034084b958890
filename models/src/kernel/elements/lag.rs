//! First-order lag.

use mops_language::Scalar;

/// First-order lag `T y' = u - y`: the transfer function `1/(T s + 1)`, with its output as state.
#[derive(Debug, Clone, Copy)]
pub struct Lag<S> {
    /// Time constant `T`, s, positive.
    pub time: S,
}

impl<S: Scalar> Lag<S> {
    /// Returns `y'` for input `u` and state `y`.
    #[inline]
    pub fn derivative(&self, u: S, y: S) -> S {
        (u - y) / self.time
    }
}
