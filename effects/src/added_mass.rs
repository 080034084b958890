//! Additional mass that moves with a joint.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `added-mass`.
pub struct AddedMass;

/// Effect at given parameters.
struct AtParameters<S> {
    m: S,
}

impl Definition for AddedMass {
    const NAME: &'static str = "added-mass";
    const ABOUT: &'static str =
        "Additional mass or inertia that moves with the joint, such as a load or the water around a body.";
    const FORMULA: &'static str = "-m q''";
    const SOURCE: &'static str = "H. Lamb, Hydrodynamics, 6th edition (Cambridge 1932), chapter VI";
    const CLASS: EffectClass = EffectClass::Inertial;
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::positive(
        "m",
        "mass or inertia",
        Dimension::OUTPUT.over(Dimension::SPEED).over(Dimension::PER_TIME),
    )];
    const IS_INERTIAL: bool = true;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { m: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.m * at.a / (self.m * at.mobility + 1.0)
    }

    fn inertia(&self, _: &PortState<'_, S>) -> S {
        self.m
    }
}
