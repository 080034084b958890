//! Quadratic loss.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength};

use super::Definition;

/// Effect `quadratic-loss`.
pub struct QuadraticLoss;

/// Effect at given parameters.
struct AtStrengths<S> {
    k: S,
}

impl Definition for QuadraticLoss {
    const NAME: &'static str = "quadratic-loss";
    const ABOUT: &'static str = "A loss proportional to the square of the state.";
    const FORMULA: &'static str = "-k x |x|";
    const SOURCE: &'static str = "F. M. White, Fluid Mechanics, 7th edition (McGraw-Hill 2011), chapter 6";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const PORTS: &'static [PortKind] = &[PortKind::Process];
    const STRENGTHS: &'static [Strength] =
        &[Strength::positive("k", "loss per square", Dimension::OUTPUT.over(Dimension::POSITION.power(2)))];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { k: s[0] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        -self.k * at.q * at.q.abs()
    }
}
