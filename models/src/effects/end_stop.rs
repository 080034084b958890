//! Elastic stops at both ends.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;
use super::terms::{ANY, above};

/// `end-stop`.
pub struct EndStop;

/// At given strengths.
struct AtStrengths<S> {
    k: S,
    low: S,
    high: S,
}

impl Definition for EndStop {
    const NAME: &'static str = "end-stop";
    const ABOUT: &'static str = "Elastic stops that push back beyond a lower and an upper position.";
    const FORMULA: &'static str = "-k max(q - high, 0) + k max(low - q, 0)";
    const SOURCE: &'static str = "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations (Wiley 1979), chapter 4";
    const CLASS: EffectClass = EffectClass::Elastic;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const STRENGTHS: &'static [Strength] = &[
        Strength::positive("k", "stiffness of the stops", Dimension::OUTPUT.over(Dimension::POSITION)),
        Strength::shape(
            "low",
            "position of the lower stop",
            Dimension::POSITION,
            ANY,
            Trials::Within(&[0.0, 0.05, 0.2]),
        ),
        Strength::shape(
            "high",
            "position of the upper stop",
            Dimension::POSITION,
            ANY,
            Trials::Within(&[0.8, 0.95, 1.0]),
        ),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { k: s[0], low: s[1], high: s[2] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        self.k * (above(self.low - at.q) - above(at.q - self.high))
    }
}
