//! Delay of a measurement.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `sensor-delay`.
pub struct SensorDelay;

/// Effect at given parameters.
struct AtParameters<S> {
    delay: S,
}

impl Definition for SensorDelay {
    const NAME: &'static str = "sensor-delay";
    const ABOUT: &'static str = "The measurement is delayed by a constant time.";
    const FORMULA: &'static str = "y(t - delay); before the start, y has its value just before it; in an experiment, y is extrapolated with its initial slope and curvature";
    const SOURCE: &'static str =
        "L. Ljung, System Identification: Theory for the User, 2nd edition (Prentice Hall 1999), section 4.2";
    const CLASS: EffectClass = EffectClass::DelayLike;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::positive("delay", "delay", Dimension::TIME)
        .with_grid(InitialGrid::Scaled(&[0.02, 0.05, 0.1, 0.2, 0.5]))];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { delay: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value
    }

    fn delay(&self) -> Option<S> {
        Some(self.delay)
    }
}
