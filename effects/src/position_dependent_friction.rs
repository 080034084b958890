//! Dry friction that depends on the position.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, DryFriction, EffectClass, EffectParameter, InitialGrid, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::{phase, waves};

/// Effect `position-dependent-friction`.
pub struct PositionDependentFriction;

/// Effect at given parameters.
struct AtParameters<S> {
    c: S,
    a: S,
    n: S,
    phase: S,
}

impl Definition for PositionDependentFriction {
    const NAME: &'static str = "position-dependent-friction";
    const ABOUT: &'static str =
        "Dry friction that varies with the position, for example of a bent shaft or a rail with local wear.";
    const FORMULA: &'static str =
        "-c (1 + a cos(n q + phase)) sgn(v); at rest any balancing force up to this magnitude";
    const SOURCE: &'static str = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis \
                                  tools and compensation methods for the control of machines with friction, Automatica \
                                  30 (1994), section 2";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Friction);
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("c", "mean friction force", Dimension::OUTPUT),
        EffectParameter::shape(
            "a",
            "relative amplitude of the variation",
            Dimension::ONE,
            [0.0, 1.0],
            InitialGrid::Plain(&[0.6]),
        )
        .least_is(&["coulomb-friction"]),
        waves(InitialGrid::PlainAndScaled(&[1.0, 2.0, 3.0, 4.0, 6.0], &[1.0, 2.0, 3.5, 5.5, 8.5, 13.0])),
        phase(),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { c: s[0], a: s[1], n: s[2], phase: s[3] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, _: &PortState<'_, S>, _: &[S]) -> S {
        S::from(0.0)
    }

    fn friction(&self, at: &PortState<'_, S>, _: &[S]) -> Option<DryFriction<S>> {
        let share = self.a * (self.n * at.q + self.phase).cos();
        let sliding = [self.c * (share + 1.0); 2];
        Some(DryFriction { sliding, limit: sliding })
    }
}
