//! Dry friction that depends on the direction of motion.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, DryFriction, EffectClass, EffectParameter, InitialGrid, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;

/// Effect `asymmetric-friction`.
pub struct AsymmetricFriction;

/// Effect at given parameters.
struct AtParameters<S> {
    c: S,
    skew: S,
}

impl Definition for AsymmetricFriction {
    const NAME: &'static str = "asymmetric-friction";
    const ABOUT: &'static str = "Dry friction that differs between forward and backward motion.";
    const FORMULA: &'static str =
        "-c (1 + skew) forward, c (1 - skew) backward; at rest any balancing force within these";
    const SOURCE: &'static str = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis \
                                  tools and compensation methods for the control of machines with friction, Automatica \
                                  30 (1994), section 2";
    const CLASS: EffectClass = EffectClass::Dissipative;
    // Coulomb friction and a constant force.
    const IS_SUM: bool = true;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Friction);
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("c", "mean of both friction forces", Dimension::OUTPUT),
        EffectParameter::shape(
            "skew",
            "difference of both friction forces divided by their sum, positive if friction is larger forward",
            Dimension::ONE,
            [-1.0, 1.0],
            InitialGrid::Plain(&[-0.4, 0.4]),
        ),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { c: s[0], skew: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, _: &PortState<'_, S>, _: &[S]) -> S {
        S::from(0.0)
    }

    fn friction(&self, _: &PortState<'_, S>, _: &[S]) -> Option<DryFriction<S>> {
        let sliding = [self.c * (self.skew + 1.0), self.c * (-self.skew + 1.0)];
        Some(DryFriction { sliding, limit: sliding })
    }
}
