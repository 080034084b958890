//! Dry friction that decreases with speed.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, DryFriction, EffectClass, EffectParameter, InitialGrid, ParameterKind,
    PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::NOT_NEGATIVE;

/// Effect `stribeck-friction`.
pub struct StribeckFriction;

/// Effect at given parameters.
struct AtParameters<S> {
    c: S,
    rise: S,
    vs: S,
}

impl Definition for StribeckFriction {
    const NAME: &'static str = "stribeck-friction";
    const ABOUT: &'static str = "Dry friction that decreases from a larger value at rest to a constant at high speed.";
    const FORMULA: &'static str = "-c (1 + rise exp(-(v/vs)^2)) sgn(v); at rest any balancing force up to c (1 + rise)";
    const SOURCE: &'static str = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis \
                                  tools and compensation methods for the control of machines with friction, Automatica \
                                  30 (1994), section 2";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Friction);
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("c", "friction force at high speed", Dimension::OUTPUT),
        EffectParameter::shape(
            "rise",
            "friction force at rest divided by that at high speed, minus 1",
            Dimension::ONE,
            NOT_NEGATIVE,
            InitialGrid::Plain(&[0.4, 1.5]),
        )
        .least_is(&["coulomb-friction"]),
        EffectParameter::shape(
            "vs",
            "speed at which the rise has decreased to 1/e",
            Dimension::SPEED,
            NOT_NEGATIVE,
            InitialGrid::Scaled(&[0.03, 0.1, 0.3, 0.8]),
        )
        .least_is(&["coulomb-friction"])
        .most_is(&["coulomb-friction"])
        .of_kind(ParameterKind::BuildUp),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { c: s[0], rise: s[1], vs: s[2] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, _: &PortState<'_, S>, _: &[S]) -> S {
        S::from(0.0)
    }

    fn friction(&self, at: &PortState<'_, S>, _: &[S]) -> Option<DryFriction<S>> {
        let rise = if self.vs.value() > 0.0 {
            let ratio = at.v / self.vs;
            self.rise * (-(ratio * ratio)).exp()
        } else {
            S::from(0.0)
        };
        let sliding = [self.c * (rise + 1.0); 2];
        Some(DryFriction { sliding, limit: [self.c * (self.rise + 1.0); 2] })
    }
}
