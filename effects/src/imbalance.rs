//! Mass off the axis of rotation.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength};

use super::Definition;
use super::terms::phase;

/// Effect `imbalance`.
pub struct Imbalance;

/// Effect at given parameters.
struct AtStrengths<S> {
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
    const STRENGTHS: &'static [Strength] =
        &[Strength::positive("a", "amplitude of the gravity torque", Dimension::OUTPUT), phase()];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { a: s[0], phase: s[1] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        -self.a * (at.q - self.phase).sin()
    }
}
