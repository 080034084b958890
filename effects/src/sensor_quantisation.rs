//! Quantised measurement.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;
use super::terms::quantised;

/// Effect `sensor-quantisation`.
pub struct SensorQuantisation;

/// Effect at given parameters.
struct AtStrengths<S> {
    step: S,
}

impl Definition for SensorQuantisation {
    const NAME: &'static str = "sensor-quantisation";
    const ABOUT: &'static str = "The measurement is quantised.";
    const FORMULA: &'static str = "step round(y/step)";
    const SOURCE: &'static str = "B. Widrow, I. Kollar, Quantization Noise (Cambridge 2008)";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const STRENGTHS: &'static [Strength] =
        &[Strength::positive("step", "quantisation step", Dimension::VALUE).tried(Trials::Steps)];
    const RARITY: u8 = 2;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { step: s[0] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        quantised(at.value, self.step)
    }
}
