//! Viscous friction.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `viscous-friction`.
pub struct ViscousFriction;

/// Effect at given parameters.
pub struct Viscous<S> {
    factor: S,
}

impl Definition for ViscousFriction {
    const NAME: &'static str = "viscous-friction";
    const ABOUT: &'static str = "A force against the motion, proportional to the speed.";
    const FORMULA: &'static str = "-d v";
    const SOURCE: &'static str = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and \
                                  compensation methods for the control of machines with friction, Automatica 30 (1994), section 2.1";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const ACTS_BETWEEN: bool = true;
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("d", "force per speed", Dimension::OUTPUT.over(Dimension::SPEED))];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(parameters: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(Viscous { factor: parameters[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for Viscous<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.factor * at.v
    }
}
