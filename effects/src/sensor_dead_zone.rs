//! Dead zone of a sensor.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::{ANY, without_gap};

/// Effect `sensor-dead-zone`.
pub struct SensorDeadZone;

/// Effect at given parameters.
struct AtParameters<S> {
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
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::DeadBand);
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("width", "largest change that is not measured", Dimension::VALUE)
            .with_grid(InitialGrid::Scaled(&[0.05, 0.2, 0.5])),
        EffectParameter::shape(
            "centre",
            "middle of the dead zone",
            Dimension::VALUE,
            ANY,
            InitialGrid::Within(&[0.2, 0.35, 0.5, 0.65, 0.8]),
        ),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { width: s[0], centre: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        without_gap(at.value, self.centre, self.width, at.closed)
    }

    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        Some((at.value - self.centre).abs() - self.width)
    }
}
