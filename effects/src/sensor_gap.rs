//! Potentiometer with a gap.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::ANY;

/// Effect `sensor-gap`.
pub struct SensorGap;

/// Effect at given parameters.
struct AtParameters<S> {
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
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::DeadBand);
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("width", "half the width of the gap", Dimension::VALUE)
            .with_grid(InitialGrid::ScaledAndGap(&[0.05, 0.1, 0.2, 0.4])),
        EffectParameter::shape(
            "centre",
            "middle of the gap, and the value shown there",
            Dimension::VALUE,
            ANY,
            InitialGrid::WithinAndGap(&[0.2, 0.35, 0.5, 0.65, 0.8]),
        ),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { width: s[0], centre: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let within = at.closed.unwrap_or((at.value - self.centre).value().abs() < self.width.value());
        if within { self.centre } else { at.value }
    }

    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        Some((at.value - self.centre).abs() - self.width)
    }
}
