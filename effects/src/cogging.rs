//! Cogging force of teeth or magnets.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{phase, waves};

/// Effect `cogging`.
pub struct Cogging;

/// Effect at given parameters.
struct AtParameters<S> {
    a: S,
    n: S,
    phase: S,
}

impl Definition for Cogging {
    const NAME: &'static str = "cogging";
    const ABOUT: &'static str =
        "A force from magnets or teeth that is periodic in the angle, an integer number of periods per turn.";
    const FORMULA: &'static str = "a sin(n q + phase)";
    const SOURCE: &'static str =
        "D. C. Hanselman, Brushless Permanent Magnet Motor Design, 2nd edition (The Writers' Collective 2003)";
    const CLASS: EffectClass = EffectClass::Periodic;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const IS_OVER_A_TURN: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("a", "amplitude", Dimension::OUTPUT),
        waves(InitialGrid::Plain(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 16.0, 24.0])).kept(),
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
