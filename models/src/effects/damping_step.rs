//! Friction in proportion to the speed that changes once.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;
use super::terms::{NOT_NEGATIVE, risen};

/// `damping-step`.
pub struct DampingStep;

/// At given strengths.
struct AtStrengths<S> {
    d: S,
    from: S,
    length: S,
}

impl Definition for DampingStep {
    const NAME: &'static str = "damping-step";
    const ABOUT: &'static str = "Viscous friction that becomes more or less once, as when something begins to rub.";
    const FORMULA: &'static str =
        "-d s v with s = (1 - cos(pi (t - from)/length))/2 for from < t < from + length, 0 before, 1 later";
    const SOURCE: &'static str =
        "R. Isermann, Fault-Diagnosis Systems (Springer 2006), chapter 5 (faults of parameters, abrupt and drifting)";
    const CLASS: EffectClass = EffectClass::TimeVarying;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const STRENGTHS: &'static [Strength] = &[
        Strength::signed("d", "force per speed that is gained", Dimension::OUTPUT.over(Dimension::SPEED)),
        Strength::shape(
            "from",
            "start",
            Dimension::TIME,
            NOT_NEGATIVE,
            Trials::Moments(&[0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85]),
        ),
        Strength::shape("length", "duration", Dimension::TIME, NOT_NEGATIVE, Trials::Moments(&[0.03, 0.12])),
    ];
    const IS_ONE_OFF: bool = true;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { d: s[0], from: s[1], length: s[2] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn breaks(&self) -> Vec<f64> {
        vec![self.from.value(), self.from.value() + self.length.value()]
    }

    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        -self.d * at.v * risen(at.t, self.from, self.length)
    }
}
