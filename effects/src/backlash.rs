//! Backlash.

use mops_core::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState, Scalar};

use super::Definition;
use super::terms::clamp;

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
    const HYSTERESIS_STATES: usize = 1;
    const FREE_STARTS: &'static [Dimension] = &[Dimension::VALUE];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { gap: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value
    }

    fn update_hysteresis(&self, at: &PortState<'_, S>, memory: &mut [S]) {
        let first = memory[0].value().is_nan();
        memory[0] = if first { at.value } else { self.hysteresis_value(at, memory) };
    }

    fn hysteresis_value(&self, at: &PortState<'_, S>, memory: &[S]) -> S {
        if self.gap.value() > 0.0 {
            clamp(memory[0], at.value - self.gap * 0.5, at.value + self.gap * 0.5)
        } else {
            at.value
        }
    }
}
