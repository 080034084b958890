//! Dry friction that decreases with speed.

use mops_core::{Acting, At, Dimension, DryFriction, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;
use super::terms::NOT_NEGATIVE;

/// Effect `stribeck-friction`.
pub struct StribeckFriction;

/// Effect at given parameters.
struct AtStrengths<S> {
    c: S,
    rise: S,
    vs: S,
}

impl Definition for StribeckFriction {
    const NAME: &'static str = "stribeck-friction";
    const ABOUT: &'static str = "Dry friction that decreases from a larger value at rest to a constant at high speed.";
    const FORMULA: &'static str = "-c (1 + rise exp(-(v/vs)^2)) sgn(v); at rest any balancing force up to c (1 + rise)";
    const SOURCE: &'static str = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis \
                                  tools and compensation methods for the control of machines with friction, Automatica \
                                  30 (1994), section 2";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const STRENGTHS: &'static [Strength] = &[
        Strength::positive("c", "friction force at high speed", Dimension::OUTPUT),
        Strength::shape(
            "rise",
            "friction force at rest divided by that at high speed, minus 1",
            Dimension::ONE,
            NOT_NEGATIVE,
            Trials::Plain(&[0.4, 1.5]),
        ),
        Strength::shape(
            "vs",
            "speed at which the rise has decreased to 1/e",
            Dimension::SPEED,
            NOT_NEGATIVE,
            Trials::Scaled(&[0.03, 0.1, 0.3, 0.8]),
        ),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { c: s[0], rise: s[1], vs: s[2] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, _: &At<'_, S>, _: &[S]) -> S {
        S::from(0.0)
    }

    fn friction(&self, at: &At<'_, S>, _: &[S]) -> Option<DryFriction<S>> {
        let rise = if self.vs.value() > 0.0 {
            let ratio = at.v / self.vs;
            self.rise * (-(ratio * ratio)).exp()
        } else {
            S::from(0.0)
        };
        let sliding = [self.c * (rise + 1.0); 2];
        Some(DryFriction { sliding, limit: [self.c * (self.rise + 1.0); 2] })
    }
}
