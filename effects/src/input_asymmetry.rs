//! Actuator whose gain depends on the direction.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `input-asymmetry`.
pub struct InputAsymmetry;

/// Effect at given parameters.
struct AtParameters<S> {
    a: S,
}

impl Definition for InputAsymmetry {
    const NAME: &'static str = "input-asymmetry";
    const ABOUT: &'static str = "The gain of the command differs between positive and negative commands.";
    const FORMULA: &'static str = "u + a |u|";
    const SOURCE: &'static str = "R. Isermann, Fault-Diagnosis Systems (Springer 2006)";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::signed(
        "a",
        "relative increase of the gain for positive and decrease for negative commands",
        Dimension::ONE,
    )
    .within(-1.0, 1.0)];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { a: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let negative = at.closed.unwrap_or(at.value.value() < 0.0);
        if negative { at.value - self.a * at.value } else { at.value + self.a * at.value }
    }

    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        Some(at.value)
    }
}
