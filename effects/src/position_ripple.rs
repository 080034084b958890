//! Force that is periodic along a position.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{phase, waves};

/// Effect `position-ripple`.
pub struct PositionRipple;

/// Effect at given parameters.
struct AtParameters<S> {
    a: S,
    n: S,
    phase: S,
}

impl Definition for PositionRipple {
    const NAME: &'static str = "position-ripple";
    const ABOUT: &'static str = "A force that is periodic in the position with an arbitrary period: the magnets of a \
                                 linear motor, the pitch of a screw.";
    const FORMULA: &'static str = "a sin(n q + phase)";
    const SOURCE: &'static str =
        "D. C. Hanselman, Brushless Permanent Magnet Motor Design, 2nd edition (The Writers' Collective 2003)";
    const CLASS: EffectClass = EffectClass::Periodic;
    const FORM_OF: Option<&'static str> = Some("cogging");
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("a", "amplitude", Dimension::OUTPUT),
        waves(InitialGrid::Scaled(&[2.0, 3.5, 5.0, 7.0, 9.0, 12.0, 16.0, 21.0, 28.0, 36.0])),
        phase(),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { a: s[0], n: s[1], phase: s[2] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        self.a * (self.n * at.q + self.phase).sin()
    }
}
