//! Break-away force above the force of sliding.

use mops_core::{Acting, At, Dimension, DryFriction, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;

/// `stiction`.
pub struct Stiction;

/// At given strengths.
struct AtStrengths<S> {
    c: S,
    share: S,
}

impl Definition for Stiction {
    const NAME: &'static str = "stiction";
    const ABOUT: &'static str = "Dry friction with a larger force at rest than in motion.";
    const FORMULA: &'static str = "-share c sgn(v); at rest whatever holds it, up to c";
    const SOURCE: &'static str = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis \
                                  tools and compensation methods for the control of machines with friction, Automatica \
                                  30 (1994), section 2";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const STRENGTHS: &'static [Strength] = &[
        Strength::positive("c", "force at which the joint breaks away", Dimension::OUTPUT),
        Strength::shape(
            "share",
            "force of sliding over that of breaking away",
            Dimension::ONE,
            [0.0, 1.0],
            Trials::Plain(&[0.0, 0.4, 0.8]),
        ),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { c: s[0], share: s[1] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, _: &At<'_, S>, _: &[S]) -> S {
        S::from(0.0)
    }

    fn friction(&self, _: &At<'_, S>, _: &[S]) -> Option<DryFriction<S>> {
        let sliding = [self.c * self.share; 2];
        Some(DryFriction { sliding, limit: [self.c; 2] })
    }
}
