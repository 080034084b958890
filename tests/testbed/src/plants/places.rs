//! Places of effects that many plants have.

use crate::plant::Place;

/// Creates an angle with viscous friction and without a spring in the baseline model.
pub(super) const fn angle(q: usize, v: usize, rest: f64) -> Place {
    Place::Joint { q, v, rest, angle: true, damped: true, sprung: false }
}

/// Creates a length with viscous friction and without a spring in the baseline model.
pub(super) const fn length(q: usize, v: usize) -> Place {
    Place::Joint { q, v, rest: 0.0, angle: false, damped: true, sprung: false }
}
