//! A spring that is stiffer to one side.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength};

use super::Definition;

/// `quadratic-stiffness`.
pub struct QuadraticStiffness;

/// At given strengths.
struct AtStrengths<S> {
    k: S,
}

impl Definition for QuadraticStiffness {
    const NAME: &'static str = "quadratic-stiffness";
    const ABOUT: &'static str =
        "A spring whose force has a share with the square of the position, so that it is stiffer to one side.";
    const FORMULA: &'static str = "-k q^2";
    const SOURCE: &'static str = "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations (Wiley 1979), chapter 4";
    const CLASS: EffectClass = EffectClass::Elastic;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const STRENGTHS: &'static [Strength] = &[Strength::signed(
        "k",
        "force per squared displacement",
        Dimension::OUTPUT.over(Dimension::POSITION.power(2)),
    )];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { k: s[0] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        -self.k * at.q * at.q
    }
}
