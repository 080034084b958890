//! Thrust with a quadratic part in the command.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `quadratic-input`.
pub struct QuadraticInput;

/// Effect at given parameters.
struct AtParameters<S> {
    a: S,
}

impl Definition for QuadraticInput {
    const NAME: &'static str = "quadratic-input";
    const ABOUT: &'static str = "The command has a quadratic part, like the thrust of a fan.";
    const FORMULA: &'static str = "u + a u |u|";
    const SOURCE: &'static str = "T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control (Wiley 2011)";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::signed(
        "a",
        "relative change of the gain per command",
        Dimension::OUTPUT.over(Dimension::VALUE.power(2)),
    )];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { a: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value + self.a * at.value * at.value.abs()
    }
}
