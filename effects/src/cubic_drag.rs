//! Drag proportional to the third power of the speed.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `cubic-drag`.
pub struct CubicDrag;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
}

impl Definition for CubicDrag {
    const NAME: &'static str = "cubic-drag";
    const ABOUT: &'static str = "A force against the motion, proportional to the third power of the speed.";
    const FORMULA: &'static str = "-k v^3";
    const SOURCE: &'static str = "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations (Wiley 1979), chapter 3";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::positive(
        "k",
        "force per speed to the third power",
        Dimension::OUTPUT.over(Dimension::SPEED.power(3)),
    )];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.k * at.v * at.v * at.v
    }
}
