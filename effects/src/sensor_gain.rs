//! A factor on a measurement.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength};

use super::Definition;

/// `sensor-gain`.
pub struct SensorGain;

/// At given strengths.
struct AtStrengths<S> {
    g: S,
}

impl Definition for SensorGain {
    const NAME: &'static str = "sensor-gain";
    const ABOUT: &'static str = "What is measured is larger or smaller than it should be.";
    const FORMULA: &'static str = "y (1 + g)";
    const SOURCE: &'static str = "J. Fraden, Handbook of Modern Sensors, 5th edition (Springer 2016)";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const STRENGTHS: &'static [Strength] =
        // An assumption: what is off by half is another scale, or a mistake of units.
        &[Strength::signed("g", "error of the gain", Dimension::ONE).within(-0.5, 0.5)];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { g: s[0] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        at.value * (self.g + 1.0)
    }
}
