//! Quantised measurement.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::quantised;

/// Effect `sensor-quantisation`.
pub struct SensorQuantisation;

/// Effect at given parameters.
struct AtParameters<S> {
    step: S,
}

impl Definition for SensorQuantisation {
    const NAME: &'static str = "sensor-quantisation";
    const ABOUT: &'static str = "The measurement is quantised.";
    const FORMULA: &'static str = "step round(y/step)";
    const SOURCE: &'static str = "B. Widrow, I. Kollar, Quantization Noise (Cambridge 2008)";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("step", "quantisation step", Dimension::VALUE).with_grid(InitialGrid::Steps)];
    const RARITY: u8 = 2;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { step: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        quantised(at.value, self.step)
    }
}
