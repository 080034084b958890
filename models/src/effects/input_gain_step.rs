//! A factor on an input that changes once.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;
use super::terms::{NOT_NEGATIVE, risen};

/// `input-gain-step`.
pub struct InputGainStep;

/// At given strengths.
struct AtStrengths<S> {
    g: S,
    from: S,
    length: S,
}

impl Definition for InputGainStep {
    const NAME: &'static str = "input-gain-step";
    const ABOUT: &'static str =
        "The command begins to act stronger or weaker, as when a supply or a valve fails in part.";
    const FORMULA: &'static str =
        "u (1 + g s) with s = (1 - cos(pi (t - from)/length))/2 for from < t < from + length, 0 before, 1 later";
    const SOURCE: &'static str =
        "R. Isermann, Fault-Diagnosis Systems (Springer 2006), chapter 5 (faults of parameters, abrupt and drifting)";
    const CLASS: EffectClass = EffectClass::TimeVarying;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const STRENGTHS: &'static [Strength] = &[
        Strength::signed("g", "share that is gained", Dimension::ONE).within(-1.0, f64::INFINITY),
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
        Box::new(AtStrengths { g: s[0], from: s[1], length: s[2] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn breaks(&self) -> Vec<f64> {
        vec![self.from.value(), self.from.value() + self.length.value()]
    }

    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        at.value * (self.g * risen(at.t, self.from, self.length) + 1.0)
    }
}
