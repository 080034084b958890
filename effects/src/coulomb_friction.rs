//! Coulomb friction.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, DryFriction, EffectClass, EffectParameter, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;

/// Effect `coulomb-friction`.
pub struct CoulombFriction;

/// Effect at given parameters.
pub struct Coulomb<S> {
    torque: S,
}

impl Definition for CoulombFriction {
    const NAME: &'static str = "coulomb-friction";
    const ABOUT: &'static str =
        "A force of constant magnitude against the motion; a joint at rest sticks up to the same magnitude.";
    const FORMULA: &'static str = "-c sgn(v); at rest any balancing force up to c";
    const SOURCE: &'static str = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and \
                                  compensation methods for the control of machines with friction, Automatica 30 (1994), section 2.1";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Friction);
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("c", "friction force", Dimension::OUTPUT)];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(parameters: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(Coulomb { torque: parameters[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for Coulomb<S> {
    fn value(&self, _: &PortState<'_, S>, _: &[S]) -> S {
        S::from(0.0)
    }

    fn friction(&self, _: &PortState<'_, S>, _: &[S]) -> Option<DryFriction<S>> {
        Some(DryFriction { sliding: [self.torque; 2], limit: [self.torque; 2] })
    }
}
