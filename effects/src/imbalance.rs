//! Mass off the axis of rotation.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::phase;

/// Effect `imbalance`.
pub struct Imbalance;

/// Effect at given parameters.
struct AtParameters<S> {
    a: S,
    phase: S,
}

impl Definition for Imbalance {
    const NAME: &'static str = "imbalance";
    const ABOUT: &'static str =
        "The gravity torque of a mass off the axis of rotation; also a tilted base, or buoyancy.";
    const FORMULA: &'static str = "-a sin(q - phase)";
    const SOURCE: &'static str = "J. P. Den Hartog, Mechanical Vibrations, 4th edition (McGraw-Hill 1956), chapter 6";
    const CLASS: EffectClass = EffectClass::Gravity;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const IS_OVER_A_TURN: bool = true;
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("a", "amplitude of the gravity torque", Dimension::OUTPUT), phase()];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { a: s[0], phase: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.a * (at.q - self.phase).sin()
    }
}
