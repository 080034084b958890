//! Sinusoidal disturbance.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{NOT_NEGATIVE, phase};

/// Effect `periodic-disturbance`.
pub struct PeriodicDisturbance;

/// Effect at given parameters.
struct AtParameters<S> {
    a: S,
    w: S,
    phase: S,
}

impl Definition for PeriodicDisturbance {
    const NAME: &'static str = "periodic-disturbance";
    const ABOUT: &'static str = "A force, torque or flow that is sinusoidal in time.";
    const FORMULA: &'static str = "a sin(w t + phase)";
    const SOURCE: &'static str = "K. Ogata, Modern Control Engineering, 5th edition (Prentice Hall 2010), chapter 7";
    const CLASS: EffectClass = EffectClass::Periodic;
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed, PortKind::Process];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("a", "amplitude", Dimension::OUTPUT),
        EffectParameter::shape(
            "w",
            "angular frequency, rad/s",
            Dimension::PER_TIME,
            NOT_NEGATIVE,
            InitialGrid::Frequencies(0.0),
        ),
        phase().per_experiment(),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { a: s[0], w: s[1], phase: s[2] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn longest_step(&self) -> f64 {
        std::f64::consts::TAU / (16.0 * self.w.value().abs())
    }

    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        self.a * (self.w * at.t + self.phase).sin()
    }
}
