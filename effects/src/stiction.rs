//! Break-away force above the sliding force.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, DryFriction, EffectClass, EffectParameter, InitialGrid, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::NOT_NEGATIVE;

/// Effect `stiction`.
pub struct Stiction;

/// Effect at given parameters.
struct AtParameters<S> {
    c: S,
    rise: S,
}

impl Definition for Stiction {
    const NAME: &'static str = "stiction";
    const ABOUT: &'static str = "Dry friction that is larger at rest than in motion.";
    const FORMULA: &'static str = "-c sgn(v); at rest any balancing force up to c (1 + rise)";
    const SOURCE: &'static str = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis \
                                  tools and compensation methods for the control of machines with friction, Automatica \
                                  30 (1994), section 2";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Friction);
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("c", "friction force in motion", Dimension::OUTPUT),
        EffectParameter::shape(
            "rise",
            "friction force at rest divided by that in motion, minus 1",
            Dimension::ONE,
            NOT_NEGATIVE,
            InitialGrid::Jumps(&[0.0, 0.5]),
        )
        .least_is(&["coulomb-friction"]),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { c: s[0], rise: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, _: &PortState<'_, S>, _: &[S]) -> S {
        S::from(0.0)
    }

    fn friction(&self, _: &PortState<'_, S>, _: &[S]) -> Option<DryFriction<S>> {
        Some(DryFriction { sliding: [self.c; 2], limit: [self.c * (self.rise + 1.0); 2] })
    }
}
