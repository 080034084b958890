//! Actuator with a rate limit.

use mops_core::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState, Scalar};

use super::Definition;
use super::terms::clamp;

/// Effect `input-rate-limit`.
pub struct InputRateLimit;

/// Effect at given parameters.
struct AtParameters<S> {
    rate: S,
}

impl Definition for InputRateLimit {
    const NAME: &'static str = "input-rate-limit";
    const ABOUT: &'static str = "The actuator follows the command with a limited rate.";
    const FORMULA: &'static str = "u' between -rate and rate";
    const SOURCE: &'static str = "L. Zaccarian, A. R. Teel, Modern Anti-windup Synthesis (Princeton 2011)";
    const CLASS: EffectClass = EffectClass::DelayLike;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("rate", "maximum rate", Dimension::VALUE.over(Dimension::TIME))
            .null_at(f64::INFINITY)
            .with_grid(InitialGrid::SlewAndScaled(&[0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 0.95], &[0.3, 1.0, 3.0]))];
    const HYSTERESIS_STATES: usize = 2;
    const FREE_STARTS: &'static [Dimension] = &[Dimension::VALUE];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { rate: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value
    }

    fn update_hysteresis(&self, at: &PortState<'_, S>, memory: &mut [S]) {
        let first = memory[0].value().is_nan();
        memory[0] = if first { at.value } else { self.hysteresis_value(at, memory) };
        memory[1] = S::from(at.t);
    }

    fn hysteresis_value(&self, at: &PortState<'_, S>, memory: &[S]) -> S {
        let way = self.rate * (at.t - memory[1].value());
        if way.value().is_nan() { at.value } else { clamp(at.value, memory[0] - way, memory[0] + way) }
    }
}
