//! Constant offset of an input.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `input-bias`.
pub struct InputBias;

/// Effect at given parameters.
struct AtParameters<S> {
    b: S,
}

impl Definition for InputBias {
    const NAME: &'static str = "input-bias";
    const ABOUT: &'static str = "A constant offset is added to the command.";
    const FORMULA: &'static str = "u + b";
    const SOURCE: &'static str = "R. Isermann, Fault-Diagnosis Systems (Springer 2006)";
    const CLASS: EffectClass = EffectClass::Bias;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::signed("b", "added offset", Dimension::OUTPUT)];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { b: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value + self.b
    }
}
