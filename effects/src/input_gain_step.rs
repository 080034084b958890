//! Gain of an input that changes once.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{STEPS_BEGIN, STEPS_LAST, Span, from, length};

/// Effect `input-gain-step`.
pub struct InputGainStep;

/// Effect at given parameters.
struct AtParameters<S> {
    g: S,
    span: Span<S>,
}

impl Definition for InputGainStep {
    const NAME: &'static str = "input-gain-step";
    const ABOUT: &'static str =
        "The gain of the command changes once, for example when a supply or a valve fails partially.";
    const FORMULA: &'static str =
        "u (1 + g s) with s = (1 - cos(pi (t - from)/length))/2 for from < t < from + length, 0 before, 1 after";
    const SOURCE: &'static str =
        "R. Isermann, Fault-Diagnosis Systems (Springer 2006), chapter 5 (faults of parameters, abrupt and drifting)";
    const CLASS: EffectClass = EffectClass::TimeVarying;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("g", "relative change of the gain", Dimension::ONE).within(-1.0, f64::INFINITY),
        from(STEPS_BEGIN),
        length(STEPS_LAST),
    ];
    const IS_ONE_OFF: bool = true;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { g: s[0], span: Span::new(&s[1..]) })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn breaks(&self) -> Vec<S> {
        self.span.breaks()
    }

    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value * (self.g * self.span.risen(at.t) + 1.0)
    }
}
