//! Viscous friction that changes once.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength};

use super::Definition;
use super::terms::{STEPS_BEGIN, STEPS_LAST, Span, from, length};

/// Effect `damping-step`.
pub struct DampingStep;

/// Effect at given parameters.
struct AtStrengths<S> {
    d: S,
    span: Span<S>,
}

impl Definition for DampingStep {
    const NAME: &'static str = "damping-step";
    const ABOUT: &'static str = "Viscous friction that changes once, for example when a part starts to rub.";
    const FORMULA: &'static str =
        "-d s v with s = (1 - cos(pi (t - from)/length))/2 for from < t < from + length, 0 before, 1 after";
    const SOURCE: &'static str =
        "R. Isermann, Fault-Diagnosis Systems (Springer 2006), chapter 5 (faults of parameters, abrupt and drifting)";
    const CLASS: EffectClass = EffectClass::TimeVarying;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const STRENGTHS: &'static [Strength] = &[
        Strength::signed("d", "change of force per speed", Dimension::OUTPUT.over(Dimension::SPEED)),
        from(STEPS_BEGIN),
        length(STEPS_LAST),
    ];
    const IS_ONE_OFF: bool = true;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { d: s[0], span: Span::new(&s[1..]) })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn breaks(&self) -> Vec<f64> {
        self.span.breaks()
    }

    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        -self.d * at.v * self.span.risen(at.t)
    }
}
