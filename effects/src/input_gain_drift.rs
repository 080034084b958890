//! Gain of an input that drifts with time.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `input-gain-drift`.
pub struct InputGainDrift;

/// Effect at given parameters.
struct AtParameters<S> {
    r: S,
}

impl Definition for InputGainDrift {
    const NAME: &'static str = "input-gain-drift";
    const ABOUT: &'static str =
        "The gain of the command drifts linearly with time, for example as a battery discharges.";
    const FORMULA: &'static str = "u (1 + r t)";
    const SOURCE: &'static str =
        "R. Isermann, Fault-Diagnosis Systems (Springer 2006), chapter 5 (faults of parameters, abrupt and drifting)";
    const CLASS: EffectClass = EffectClass::TimeVarying;
    const PORTS: &'static [PortKind] = &[PortKind::Actuator];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("r", "relative change of the gain per time", Dimension::ONE.over(Dimension::TIME))];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { r: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        at.value * (self.r * at.t + 1.0)
    }
}
