//! Actuator with a rate limit.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{clamp, sign};

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
    const HYSTERESIS_STATES: usize = 3;
    const FREE_STARTS: &'static [Dimension] = &[Dimension::VALUE];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { rate: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value
    }

    /// The state is the output at the last update, the time of that, and the direction in which the output lags behind:
    /// 0 if it follows the command.
    fn update_hysteresis(&self, at: &PortState<'_, S>, memory: &mut [S]) {
        let first = memory[0].value().is_nan();
        let way = self.rate * (at.t - memory[1]);
        memory[0] =
            if first || way.value().is_nan() { at.value } else { clamp(at.value, memory[0] - way, memory[0] + way) };
        memory[1] = at.t;
        let (behind, rate) = ((at.value - memory[0]).value(), at.v.value());
        memory[2] = S::from(match sign(behind) {
            0.0 if rate.abs() > self.rate.value() => sign(rate),
            side => side,
        });
    }

    fn hysteresis_guard(&self, at: &PortState<'_, S>, memory: &[S]) -> S {
        match sign(memory[2].value()) {
            0.0 => self.rate - at.v.abs(),
            side => (at.value - self.hysteresis_value(at, memory)) * side,
        }
    }

    fn hysteresis_value(&self, at: &PortState<'_, S>, memory: &[S]) -> S {
        match sign(memory[2].value()) {
            _ if self.rate.value().is_infinite() => at.value,
            0.0 => at.value,
            side => memory[0] + self.rate * (at.t - memory[1]) * side,
        }
    }
}
