//! Quadratic drag of a fluid.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `quadratic-drag`.
pub struct QuadraticDrag;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
}

impl Definition for QuadraticDrag {
    const NAME: &'static str = "quadratic-drag";
    const ABOUT: &'static str = "A force against the motion, proportional to the square of the speed.";
    const FORMULA: &'static str = "-k v |v|";
    const SOURCE: &'static str = "S. F. Hoerner, Fluid-Dynamic Drag (1965)";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("k", "force per squared speed", Dimension::OUTPUT.over(Dimension::SPEED.power(2)))];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.k * at.v * at.v.abs()
    }
}
