//! Single gust.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{Span, from, length};

/// Effect `wind-gust`.
pub struct WindGust;

/// Effect at given parameters.
struct AtParameters<S> {
    a: S,
    span: Span<S>,
}

impl Definition for WindGust {
    const NAME: &'static str = "wind-gust";
    const ABOUT: &'static str = "A force, torque or flow that rises and decays once.";
    const FORMULA: &'static str = "a/2 (1 - cos(2 pi (t - from)/length)) for from < t < from + length";
    const SOURCE: &'static str =
        "Certification Specifications for Large Aeroplanes CS-25 (EASA), section 25.341 (discrete gust)";
    const CLASS: EffectClass = EffectClass::TimeVarying;
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed, PortKind::Process];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("a", "peak value", Dimension::OUTPUT),
        from(&[0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]),
        length(&[0.06, 0.15, 0.4]),
    ];
    const IS_ONE_OFF: bool = true;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { a: s[0], span: Span::new(&s[1..]) })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn breaks(&self) -> Vec<S> {
        self.span.breaks()
    }

    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        self.a * 0.5 * (-(self.span.passed(at.t) * std::f64::consts::TAU).cos() + 1.0)
    }
}
