//! Gain error of a measurement.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `sensor-gain`.
pub struct SensorGain;

/// Effect at given parameters.
struct AtParameters<S> {
    g: S,
}

impl Definition for SensorGain {
    const NAME: &'static str = "sensor-gain";
    const ABOUT: &'static str = "The measurement is larger or smaller than the signal by a constant factor.";
    const FORMULA: &'static str = "y (1 + g)";
    const SOURCE: &'static str = "J. Fraden, Handbook of Modern Sensors, 5th edition (Springer 2016)";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const PARAMETERS: &'static [EffectParameter] =
        // An assumption: an error of more than half indicates another scale or a unit error.
        &[EffectParameter::signed("g", "relative error of the gain", Dimension::ONE).within(-0.5, 0.5)];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { g: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value * (self.g + 1.0)
    }
}
