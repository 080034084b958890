//! Torque ripple over the position of a rotor.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{phase, waves};

/// Effect `torque-ripple`.
pub struct TorqueRipple;

/// Effect at given parameters.
struct AtParameters<S> {
    a: S,
    n: S,
    phase: S,
}

impl Definition for TorqueRipple {
    const NAME: &'static str = "torque-ripple";
    const ABOUT: &'static str =
        "The gain of the command varies periodically with the position of a joint, for example over a motor turn.";
    const FORMULA: &'static str = "u (1 + a sin(n q + phase)), q the position of the companion joint";
    const SOURCE: &'static str =
        "D. C. Hanselman, Brushless Permanent Magnet Motor Design, 2nd edition (The Writers' Collective 2003)";
    const CLASS: EffectClass = EffectClass::Periodic;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const SECOND_PORT: Option<PortKind> = Some(PortKind::Joint);
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("a", "relative amplitude", Dimension::ONE).within(0.0, 1.0),
        waves(InitialGrid::PlainAndScaled(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 12.0], &[4.0, 7.0, 13.0])),
        phase(),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { a: s[0], n: s[1], phase: s[2] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value * (self.a * (self.n * at.other + self.phase).sin() + 1.0)
    }
}
