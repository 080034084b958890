//! Potentiometer with a gap.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;
use super::terms::ANY;

/// Effect `sensor-gap`.
pub struct SensorGap;

/// Effect at given parameters.
struct AtStrengths<S> {
    width: S,
    centre: S,
}

impl Definition for SensorGap {
    const NAME: &'static str = "sensor-gap";
    const ABOUT: &'static str = "Within a gap the sensor shows a constant value, outside it the correct value.";
    const FORMULA: &'static str = "centre if |y - centre| < width, else y";
    const SOURCE: &'static str = "J. Fraden, Handbook of Modern Sensors, 5th edition (Springer 2016)";
    const CLASS: EffectClass = EffectClass::Gain;
    const FORM_OF: Option<&'static str> = Some("sensor-dead-zone");
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const STRENGTHS: &'static [Strength] = &[
        Strength::positive("width", "half the width of the gap", Dimension::VALUE)
            .tried(Trials::ScaledAndGap(&[0.05, 0.1, 0.2, 0.4])),
        Strength::shape(
            "centre",
            "middle of the gap, and the value shown there",
            Dimension::VALUE,
            ANY,
            Trials::WithinAndGap(&[0.2, 0.35, 0.5, 0.65, 0.8]),
        ),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { width: s[0], centre: s[1] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        if (at.value - self.centre).value().abs() < self.width.value() { self.centre } else { at.value }
    }
}
