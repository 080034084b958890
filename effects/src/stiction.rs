//! Break-away force above the sliding force.

use mops_core::{Acting, At, Dimension, DryFriction, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;
use super::terms::NOT_NEGATIVE;

/// Effect `stiction`.
pub struct Stiction;

/// Effect at given parameters.
struct AtStrengths<S> {
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
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const STRENGTHS: &'static [Strength] = &[
        Strength::positive("c", "friction force in motion", Dimension::OUTPUT),
        Strength::shape(
            "rise",
            "friction force at rest divided by that in motion, minus 1",
            Dimension::ONE,
            NOT_NEGATIVE,
            Trials::Jumps(&[0.0, 0.5]),
        ),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { c: s[0], rise: s[1] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, _: &At<'_, S>, _: &[S]) -> S {
        S::from(0.0)
    }

    fn friction(&self, _: &At<'_, S>, _: &[S]) -> Option<DryFriction<S>> {
        Some(DryFriction { sliding: [self.c; 2], limit: [self.c * (self.rise + 1.0); 2] })
    }
}
