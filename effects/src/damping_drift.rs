//! Viscous friction that drifts with time.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `damping-drift`.
pub struct DampingDrift;

/// Effect at given parameters.
struct AtParameters<S> {
    r: S,
}

impl Definition for DampingDrift {
    const NAME: &'static str = "damping-drift";
    const ABOUT: &'static str =
        "Viscous friction that increases or decreases linearly with time, for example in a bearing that warms up.";
    const FORMULA: &'static str = "-r t v";
    const SOURCE: &'static str =
        "R. Isermann, Fault-Diagnosis Systems (Springer 2006), chapter 5 (faults of parameters, abrupt and drifting)";
    const CLASS: EffectClass = EffectClass::TimeVarying;
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::signed(
        "r",
        "change of force per speed, per time",
        Dimension::OUTPUT.over(Dimension::SPEED).over(Dimension::TIME),
    )];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { r: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.r * at.v * at.t
    }
}
