//! Sensor with crosstalk from another sensor.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `cross-talk`.
pub struct CrossTalk;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
}

impl Definition for CrossTalk {
    const NAME: &'static str = "cross-talk";
    const ABOUT: &'static str = "A fraction of the signal of another sensor appears in this signal.";
    const FORMULA: &'static str = "y + k y2, y2 the signal of the companion sensor";
    const SOURCE: &'static str = "J. Fraden, Handbook of Modern Sensors, 5th edition (Springer 2016)";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const SECOND_PORT: Option<PortKind> = Some(PortKind::Sensor);
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("k", "fraction of the other signal", Dimension::OUTPUT.over(Dimension::POSITION))];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value + self.k * at.other
    }
}
