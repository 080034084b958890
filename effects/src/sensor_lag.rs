//! First-order sensor.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::damped;

/// Effect `sensor-lag`.
pub struct SensorLag;

/// Effect at given parameters.
struct AtParameters<S> {
    tau: S,
}

impl Definition for SensorLag {
    const NAME: &'static str = "sensor-lag";
    const ABOUT: &'static str = "The sensor follows the signal with a first-order lag.";
    const FORMULA: &'static str = "z, z' = (y - z)/tau";
    const SOURCE: &'static str = "K. Ogata, Modern Control Engineering, 5th edition (Prentice Hall 2010), section 5-2";
    const CLASS: EffectClass = EffectClass::DelayLike;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Lag);
    const PORTS: &'static [PortKind] = &[PortKind::Sensor];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("tau", "time constant", Dimension::TIME)
            .with_grid(InitialGrid::Scaled(&[0.02, 0.05, 0.1, 0.3, 1.0]))];
    const STATES: usize = 1;
    const FREE_STARTS: &'static [Dimension] = &[Dimension::VALUE];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { tau: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn start(&self, at: &PortState<'_, S>, z: &mut [S]) {
        z[0] = at.value;
    }

    fn damped_step(&self) -> f64 {
        damped(self.tau)
    }

    fn rates(&self, at: &PortState<'_, S>, z: &[S], dz: &mut [S]) {
        dz[0] = if self.tau.value() > 0.0 { (at.value - z[0]) / self.tau } else { S::from(0.0) };
    }

    fn value(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        if self.tau.value() > 0.0 { z[0] } else { at.value }
    }
}
