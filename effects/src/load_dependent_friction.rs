//! Dry friction proportional to the transmitted load.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, DryFriction, EffectClass, EffectParameter, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;

/// Effect `load-dependent-friction`.
pub struct LoadDependentFriction;

/// Effect at given parameters.
struct AtParameters<S> {
    mu: S,
}

impl Definition for LoadDependentFriction {
    const NAME: &'static str = "load-dependent-friction";
    const ABOUT: &'static str =
        "Dry friction of a gear or bearing, proportional to the force with which an actuator loads it.";
    const FORMULA: &'static str =
        "-mu |u| sgn(v), u the input of the companion actuator; at rest any balancing force up to mu |u|";
    const SOURCE: &'static str = "A. C. Bittencourt, S. Gunnarsson, Static friction in a robot joint: modeling and \
                                  identification of load and temperature effects, Journal of Dynamic Systems, \
                                  Measurement, and Control 134 (2012)";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Friction);
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const SECOND_PORT: Option<PortKind> = Some(PortKind::Actuator);
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("mu", "friction force per input", Dimension::OUTPUT.over(Dimension::VALUE))];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { mu: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, _: &PortState<'_, S>, _: &[S]) -> S {
        S::from(0.0)
    }

    fn friction(&self, at: &PortState<'_, S>, _: &[S]) -> Option<DryFriction<S>> {
        let sliding = [self.mu * at.other.abs(); 2];
        Some(DryFriction { sliding, limit: sliding })
    }
}
