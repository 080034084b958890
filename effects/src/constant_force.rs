//! Constant load.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `constant-force`.
pub struct ConstantForce;

/// Effect at given parameters.
struct AtParameters<S> {
    f: S,
}

impl Definition for ConstantForce {
    const NAME: &'static str = "constant-force";
    const ABOUT: &'static str =
        "A constant force, torque, flow or heat gain, such as an unknown load, an incline or solar radiation.";
    const FORMULA: &'static str = "f";
    const SOURCE: &'static str = "K. Ogata, Modern Control Engineering, 5th edition (Prentice Hall 2010), chapter 3";
    const CLASS: EffectClass = EffectClass::Bias;
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed, PortKind::Process];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("f", "added force, torque or flow", Dimension::OUTPUT)];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { f: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, _: &PortState<'_, S>, _: &[S]) -> S {
        self.f
    }
}
