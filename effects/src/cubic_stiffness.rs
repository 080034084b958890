//! Hardening or softening spring.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::ANY;

/// Effect `cubic-stiffness`.
pub struct CubicStiffness;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    rest: S,
}

impl Definition for CubicStiffness {
    const NAME: &'static str = "cubic-stiffness";
    const ABOUT: &'static str = "A spring force proportional to the third power of the displacement: hardening if \
                                 positive, softening if negative.";
    const FORMULA: &'static str = "-k (q - rest)^3";
    const SOURCE: &'static str = "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations (Wiley 1979), chapter 4 (Duffing)";
    const CLASS: EffectClass = EffectClass::Elastic;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const ACTS_BETWEEN: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed(
            "k",
            "force per displacement to the third power",
            Dimension::OUTPUT.over(Dimension::POSITION.power(3)),
        ),
        EffectParameter::shape(
            "rest",
            "position without force",
            Dimension::POSITION,
            ANY,
            InitialGrid::Within(&[0.2, 0.5, 0.8]),
        ),
    ];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], rest: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let d = at.q - self.rest;
        -self.k * d * d * d
    }
}
