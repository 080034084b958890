//! Backlash between a driving and a driven part.

use mops_language::Scalar;

/// Backlash of width `gap`. The driven part `y` follows the driving part `u` at a distance of `gap/2` while it is
/// pushed. It stays at rest while `u` crosses the gap. The driven part has no inertia of its own.
///
/// Source: M. Nordin, P.-O. Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002),
/// section 2 (the play operator).
#[derive(Debug, Clone, Copy)]
pub struct Backlash<S> {
    gap: S,
    side: Side<S>,
}

/// Side of the gap that is in contact.
#[derive(Debug, Clone, Copy)]
enum Side<S> {
    /// The driving part pushes forward.
    Forward,
    /// The driving part pushes backward.
    Backward,
    /// The driving part crosses the gap; the driven part rests at this position.
    Open(S),
}

impl<S: Scalar> Backlash<S> {
    /// Creates a backlash of width `gap` (positive) with the driven part at `y`.
    pub fn new(gap: S, y: S) -> Self {
        Self { gap, side: Side::Open(y) }
    }

    /// Returns the position of the driven part in the current mode.
    #[inline]
    pub fn output(&self, u: S) -> S {
        match self.side {
            Side::Forward => u - self.gap * 0.5,
            Side::Backward => u + self.gap * 0.5,
            Side::Open(y) => y,
        }
    }

    /// Returns the guard: not negative while the mode is active; `rate` is the rate of `u`.
    #[inline]
    pub fn guard(&self, u: S, rate: S) -> S {
        match self.side {
            Side::Forward => rate,
            Side::Backward => -rate,
            Side::Open(y) => self.gap * 0.5 - (u - y).abs(),
        }
    }

    /// Switches the mode after the guard became negative.
    pub fn switch(&mut self, u: S) {
        self.side = match self.side {
            Side::Forward | Side::Backward => Side::Open(self.output(u)),
            Side::Open(y) if u.value() > y.value() => Side::Forward,
            Side::Open(_) => Side::Backward,
        };
    }

    /// Finds the mode after a jump of the driving part from `before` to `u`, or of its rate. The driven part is pushed
    /// along as far as the gap requires.
    pub fn settle(&mut self, before: S, u: S, rate: S) {
        let y = self.output(before);
        let distance = (u - y).value();
        let half = 0.5 * self.gap.value();
        self.side = if distance > half || (distance == half && rate.value() > 0.0) {
            Side::Forward
        } else if distance < -half || (distance == -half && rate.value() < 0.0) {
            Side::Backward
        } else {
            Side::Open(y)
        };
    }
}
