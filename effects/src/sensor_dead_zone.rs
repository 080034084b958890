//! Dead zone of a sensor.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;
use super::terms::{ANY, clamp};

/// Effect `sensor-dead-zone`.
pub struct SensorDeadZone;

/// Effect at given parameters.
struct AtStrengths<S> {
    width: S,
    centre: S,
}

impl Definition for SensorDeadZone {
    const NAME: &'static str = "sensor-dead-zone";
    const ABOUT: &'static str =
        "Small changes about a value are not measured, and larger ones are reduced by the width of the dead zone.";
    const FORMULA: &'static str = "y - clamp(y - centre, -width, width)";
    const SOURCE: &'static str = "G. Tao, P. V. Kokotovic, Adaptive Control of Systems with Actuator and Sensor \
                                  Nonlinearities (Wiley 1996), chapter 2";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const STRENGTHS: &'static [Strength] = &[
        Strength::positive("width", "largest change that is not measured", Dimension::VALUE)
            .tried(Trials::Scaled(&[0.05, 0.2, 0.5])),
        Strength::shape(
            "centre",
            "middle of the dead zone",
            Dimension::VALUE,
            ANY,
            Trials::Within(&[0.2, 0.35, 0.5, 0.65, 0.8]),
        ),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { width: s[0], centre: s[1] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        at.value - clamp(at.value - self.centre, -self.width, self.width)
    }
}
