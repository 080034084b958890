//! Linear spring.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::ANY;

/// Effect `linear-stiffness`.
pub struct LinearStiffness;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    rest: S,
}

impl Definition for LinearStiffness {
    const NAME: &'static str = "linear-stiffness";
    const ABOUT: &'static str = "A spring or cable that pulls back to a rest position.";
    const FORMULA: &'static str = "-k (q - rest)";
    const SOURCE: &'static str = "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations (Wiley 1979), chapter 1";
    const CLASS: EffectClass = EffectClass::Elastic;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const ACTS_BETWEEN: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("k", "force per displacement", Dimension::OUTPUT.over(Dimension::POSITION)),
        EffectParameter::shape(
            "rest",
            "position without force",
            Dimension::POSITION,
            ANY,
            InitialGrid::Within(&[0.2, 0.5, 0.8]),
        )
        .least_is(&["constant-force"])
        .most_is(&["constant-force"]),
    ];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], rest: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.k * (at.q - self.rest)
    }
}
