//! Backlash.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{clamp, sign};

/// Effect `backlash`.
pub struct Backlash;

/// Effect at given parameters.
struct AtParameters<S> {
    gap: S,
}

impl Definition for Backlash {
    const NAME: &'static str = "backlash";
    const ABOUT: &'static str = "Backlash of a gear: after a reversal the output follows only once the gap is crossed.";
    const FORMULA: &'static str =
        "play operator: the output moves only as far as needed to stay between u - gap/2 and u + gap/2";
    const SOURCE: &'static str =
        "M. Nordin, P.-O. Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002)";
    const CLASS: EffectClass = EffectClass::Gain;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator, PortKind::Sensor];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("gap", "width of the gap", Dimension::VALUE)
            .with_grid(InitialGrid::Scaled(&[0.05, 0.15, 0.4]))];
    const HYSTERESIS_STATES: usize = 2;
    const FREE_STARTS: &'static [Dimension] = &[Dimension::VALUE];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { gap: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value
    }

    /// The state is the output, and the flank at rest on the input: 1 if the input pushes upwards, -1 downwards, 0
    /// within the gap.
    fn update_hysteresis(&self, at: &PortState<'_, S>, memory: &mut [S]) {
        let half = self.gap * 0.5;
        let first = memory[0].value().is_nan();
        memory[0] = if first { at.value } else { clamp(memory[0], at.value - half, at.value + half) };
        let pushes = |side: f64| {
            let flank = (at.value - half * side).value();
            at.v.value() * side > 0.0 && (memory[0].value() - flank) * side <= 0.0
        };
        memory[1] = S::from([1.0, -1.0].into_iter().find(|&side| pushes(side)).unwrap_or(0.0));
    }

    fn hysteresis_guard(&self, at: &PortState<'_, S>, memory: &[S]) -> S {
        let (half, side) = (self.gap * 0.5, sign(memory[1].value()));
        if side != 0.0 {
            return at.v * side;
        }
        // An input that has just turned is at the edge of the gap, up to rounding.
        let rounding = 4.0 * f64::EPSILON * (at.value.value().abs() + half.value());
        half - (at.value - memory[0]).abs() + rounding
    }

    fn hysteresis_value(&self, at: &PortState<'_, S>, memory: &[S]) -> S {
        match sign(memory[1].value()) {
            0.0 => memory[0],
            side => at.value - self.gap * 0.5 * side,
        }
    }
}
