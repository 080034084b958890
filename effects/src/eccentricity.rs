//! Eccentric angular scale.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::phase;

/// Effect `eccentricity`.
pub struct Eccentricity;

/// Effect at given parameters.
struct AtParameters<S> {
    a: S,
    phase: S,
}

impl Definition for Eccentricity {
    const NAME: &'static str = "eccentricity";
    const ABOUT: &'static str = "An angle is measured with a scale whose centre is off the axis of rotation.";
    const FORMULA: &'static str = "y + a sin(y + phase)";
    const SOURCE: &'static str = "J. Fraden, Handbook of Modern Sensors, 5th edition (Springer 2016)";
    const CLASS: EffectClass = EffectClass::Periodic;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const IS_OVER_A_TURN: bool = true;
    // In rad, as the angle is, the amplitude is the offset of the centre divided by the radius of the scale. The bound
    // of half the radius is an assumption.
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("a", "amplitude", Dimension::OUTPUT).within(0.0, 0.5), phase()];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { a: s[0], phase: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value + self.a * (at.value + self.phase).sin()
    }
}
