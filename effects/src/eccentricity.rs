//! Eccentric angular scale.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength};

use super::Definition;
use super::terms::phase;

/// Effect `eccentricity`.
pub struct Eccentricity;

/// Effect at given parameters.
struct AtStrengths<S> {
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
    // In rad, as the angle is, the amplitude is the offset of the centre divided by the radius of the scale. The bound
    // of half the radius is an assumption.
    const STRENGTHS: &'static [Strength] =
        &[Strength::positive("a", "amplitude", Dimension::OUTPUT).within(0.0, 0.5), phase()];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { a: s[0], phase: s[1] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        at.value + self.a * (at.value + self.phase).sin()
    }
}
