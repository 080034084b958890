//! Delay of an input.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `input-delay`.
pub struct InputDelay;

/// Effect at given parameters.
struct AtParameters<S> {
    delay: S,
}

impl Definition for InputDelay {
    const NAME: &'static str = "input-delay";
    const ABOUT: &'static str = "The command acts after a constant delay.";
    const FORMULA: &'static str = "u(t - delay)";
    const SOURCE: &'static str =
        "L. Ljung, System Identification: Theory for the User, 2nd edition (Prentice Hall 1999), section 4.2";
    const CLASS: EffectClass = EffectClass::DelayLike;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::positive("delay", "delay", Dimension::TIME)
        .with_grid(InitialGrid::Scaled(&[0.02, 0.05, 0.1, 0.2, 0.5]))];
    const RARITY: u8 = 0;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { delay: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value
    }

    fn delay(&self) -> Option<S> {
        Some(self.delay)
    }
}
