//! Constant offset of a measurement.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `sensor-bias`.
pub struct SensorBias;

/// Effect at given parameters.
struct AtParameters<S> {
    b: S,
}

impl Definition for SensorBias {
    const NAME: &'static str = "sensor-bias";
    const ABOUT: &'static str = "A constant offset is added to the measurement.";
    const FORMULA: &'static str = "y + b";
    const SOURCE: &'static str = "J. Fraden, Handbook of Modern Sensors, 5th edition (Springer 2016)";
    const CLASS: EffectClass = EffectClass::Bias;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::signed("b", "added offset", Dimension::OUTPUT)];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { b: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value + self.b
    }
}
