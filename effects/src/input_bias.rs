//! Constant offset of an input.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength};

use super::Definition;

/// Effect `input-bias`.
pub struct InputBias;

/// Effect at given parameters.
struct AtStrengths<S> {
    b: S,
}

impl Definition for InputBias {
    const NAME: &'static str = "input-bias";
    const ABOUT: &'static str = "A constant offset is added to the command.";
    const FORMULA: &'static str = "u + b";
    const SOURCE: &'static str = "R. Isermann, Fault-Diagnosis Systems (Springer 2006)";
    const CLASS: EffectClass = EffectClass::Bias;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const STRENGTHS: &'static [Strength] = &[Strength::signed("b", "added offset", Dimension::OUTPUT)];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { b: s[0] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        at.value + self.b
    }
}
