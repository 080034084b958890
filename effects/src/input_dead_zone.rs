//! Dead zone of an actuator.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::without_gap;

/// Effect `input-dead-zone`.
pub struct InputDeadZone;

/// Effect at given parameters.
struct AtParameters<S> {
    width: S,
}

impl Definition for InputDeadZone {
    const NAME: &'static str = "input-dead-zone";
    const ABOUT: &'static str =
        "Small commands have no effect, and larger ones are reduced by the width of the dead zone.";
    const FORMULA: &'static str = "u - clamp(u, -width, width)";
    const SOURCE: &'static str = "H. K. Khalil, Nonlinear Systems, 3rd edition (Prentice Hall 2002), section 1.2.7";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("width", "largest command without effect", Dimension::VALUE)
            .with_grid(InitialGrid::Scaled(&[0.05, 0.15, 0.3, 0.6]))];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { width: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        without_gap(at.value, S::from(0.0), self.width, at.closed)
    }

    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        Some(at.value.abs() - self.width)
    }
}
