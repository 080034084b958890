//! Drift of a measurement.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength};

use super::Definition;

/// Effect `sensor-drift`.
pub struct SensorDrift;

/// Effect at given parameters.
struct AtStrengths<S> {
    r: S,
}

impl Definition for SensorDrift {
    const NAME: &'static str = "sensor-drift";
    const ABOUT: &'static str = "The measurement drifts linearly with time.";
    const FORMULA: &'static str = "y + r t";
    const SOURCE: &'static str = "J. Fraden, Handbook of Modern Sensors, 5th edition (Springer 2016)";
    const CLASS: EffectClass = EffectClass::TimeVarying;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const STRENGTHS: &'static [Strength] =
        &[Strength::signed("r", "drift per time", Dimension::OUTPUT.over(Dimension::TIME))];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { r: s[0] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        at.value + self.r * at.t
    }
}
