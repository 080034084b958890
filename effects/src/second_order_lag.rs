//! Second-order actuator or sensor.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::damped;

/// Effect `second-order-lag`.
pub struct SecondOrderLag;

/// Effect at given parameters.
struct AtParameters<S> {
    tau: S,
    d: S,
}

impl Definition for SecondOrderLag {
    const NAME: &'static str = "second-order-lag";
    const ABOUT: &'static str = "The actuator or sensor follows with a second-order lag.";
    const FORMULA: &'static str = "z, tau^2 z'' + 2 d tau z' + z = u";
    const SOURCE: &'static str = "K. Ogata, Modern Control Engineering, 5th edition (Prentice Hall 2010), section 5-3";
    const CLASS: EffectClass = EffectClass::DelayLike;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Lag);
    const PORTS: &'static [PortKind] = &[PortKind::Actuator, PortKind::Sensor];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("tau", "inverse of the natural frequency", Dimension::TIME)
            .with_grid(InitialGrid::Scaled(&[0.02, 0.05, 0.1, 0.3])),
        EffectParameter::shape("d", "damping ratio", Dimension::ONE, [0.05, 5.0], InitialGrid::Plain(&[0.3, 0.8, 1.5]))
            .most_is(&["actuator-lag", "sensor-lag"]),
    ];
    const STATES: usize = 2;
    const FREE_STARTS: &'static [Dimension] = &[Dimension::VALUE, Dimension::VALUE.over(Dimension::TIME)];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { tau: s[0], d: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn start(&self, at: &PortState<'_, S>, z: &mut [S]) {
        z.copy_from_slice(&[at.value, S::from(0.0)]);
    }

    fn damped_step(&self) -> f64 {
        0.5 * damped(self.tau) / (self.d.value() * 2.0).max(1.0)
    }

    fn rates(&self, at: &PortState<'_, S>, z: &[S], dz: &mut [S]) {
        let bend = if self.tau.value() > 0.0 {
            ((at.value - z[0]) / self.tau - self.d * z[1] * 2.0) / self.tau
        } else {
            S::from(0.0)
        };
        dz.copy_from_slice(&[z[1], bend]);
    }

    fn value(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        if self.tau.value() > 0.0 { z[0] } else { at.value }
    }
}
