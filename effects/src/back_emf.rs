//! Back electromotive force of a motor.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `back-emf`.
pub struct BackEmf;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
}

impl Definition for BackEmf {
    const NAME: &'static str = "back-emf";
    const ABOUT: &'static str = "The motion of a joint induces a voltage that opposes the command.";
    const FORMULA: &'static str = "u - k v, v the speed of the companion joint";
    const SOURCE: &'static str = "G. F. Franklin, J. D. Powell, A. Emami-Naeini, Feedback Control of Dynamic Systems, \
                                  6th edition (Pearson 2010), section 2.3";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const SECOND_PORT: Option<PortKind> = Some(PortKind::Joint);
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("k", "loss of command per speed", Dimension::OUTPUT.over(Dimension::SPEED))];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value - self.k * at.other_speed
    }
}
