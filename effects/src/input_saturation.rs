//! Actuator with saturation.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::limited;

/// Effect `input-saturation`.
pub struct InputSaturation;

/// Effect at given parameters.
struct AtParameters<S> {
    limit: S,
}

impl Definition for InputSaturation {
    const NAME: &'static str = "input-saturation";
    const ABOUT: &'static str = "The actuator saturates at the same limit in both directions.";
    const FORMULA: &'static str = "clamp(u, -limit, limit)";
    const SOURCE: &'static str = "H. K. Khalil, Nonlinear Systems, 3rd edition (Prentice Hall 2002), section 1.2.7";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::positive("limit", "limit", Dimension::VALUE)
        .null_at(f64::INFINITY)
        .with_grid(InitialGrid::WithinSize(&[0.4, 0.6, 0.7, 0.8, 0.9, 0.96]))];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { limit: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        limited(at.value, self.limit, at.closed)
    }

    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        self.limit.value().is_finite().then(|| self.limit - at.value.abs())
    }
}
