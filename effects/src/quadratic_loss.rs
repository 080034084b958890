//! Quadratic loss.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `quadratic-loss`.
pub struct QuadraticLoss;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
}

impl Definition for QuadraticLoss {
    const NAME: &'static str = "quadratic-loss";
    const ABOUT: &'static str = "A loss proportional to the square of the state.";
    const FORMULA: &'static str = "-k x |x|";
    const SOURCE: &'static str = "F. M. White, Fluid Mechanics, 7th edition (McGraw-Hill 2011), chapter 6";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const PORTS: &'static [PortKind] = &[PortKind::Process];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("k", "loss per square", Dimension::OUTPUT.over(Dimension::POSITION.power(2)))];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.k * at.q * at.q.abs()
    }
}
