//! Gain error of an input.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `input-gain`.
pub struct InputGain;

/// Effect at given parameters.
struct AtParameters<S> {
    g: S,
}

impl Definition for InputGain {
    const NAME: &'static str = "input-gain";
    const ABOUT: &'static str = "The gain of the command is larger or smaller than declared.";
    const FORMULA: &'static str = "u (1 + g)";
    const SOURCE: &'static str = "K. Ogata, Modern Control Engineering, 5th edition (Prentice Hall 2010), section 2-2";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("g", "relative error of the gain", Dimension::ONE).within(-1.0, f64::INFINITY)];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { g: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value * (self.g + 1.0)
    }
}
