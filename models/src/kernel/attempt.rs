//! Input of a one-step method.

use super::weights::Weights;

/// Input of a method: a step of length `h` from `x` at `t`.
pub struct Attempt<'a, S> {
    pub(super) t: f64,
    pub(super) h: f64,
    pub(super) x: &'a [S],
    pub(super) weights: &'a Weights,
}
