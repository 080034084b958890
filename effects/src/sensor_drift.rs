//! Drift of a measurement.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `sensor-drift`.
pub struct SensorDrift;

/// Effect at given parameters.
struct AtParameters<S> {
    r: S,
}

impl Definition for SensorDrift {
    const NAME: &'static str = "sensor-drift";
    const ABOUT: &'static str = "The measurement drifts linearly with time.";
    const FORMULA: &'static str = "y + r t";
    const SOURCE: &'static str = "J. Fraden, Handbook of Modern Sensors, 5th edition (Springer 2016)";
    const CLASS: EffectClass = EffectClass::TimeVarying;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("r", "drift per time", Dimension::OUTPUT.over(Dimension::TIME))];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { r: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value + self.r * at.t
    }
}
