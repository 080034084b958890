//! Viscous friction that changes once.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{STEPS_BEGIN, STEPS_LAST, Span, from, length};

/// Effect `damping-step`.
pub struct DampingStep;

/// Effect at given parameters.
struct AtParameters<S> {
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
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("d", "change of force per speed", Dimension::OUTPUT.over(Dimension::SPEED)),
        from(STEPS_BEGIN),
        length(STEPS_LAST),
    ];
    const IS_ONE_OFF: bool = true;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { d: s[0], span: Span::new(&s[1..]) })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn breaks(&self) -> Vec<S> {
        self.span.breaks()
    }

    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.d * at.v * self.span.risen(at.t)
    }
}
