//! Dry friction as a table over the speed.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, DryFriction, EffectClass, EffectParameter, InitialGrid, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::NOT_NEGATIVE;

/// Effect `tabulated-friction`.
pub struct TabulatedFriction;

/// Effect at given parameters.
struct AtParameters<S> {
    c: S,
    r1: S,
    r2: S,
    r3: S,
    top: S,
}

impl Definition for TabulatedFriction {
    const NAME: &'static str = "tabulated-friction";
    const ABOUT: &'static str =
        "Dry friction as an arbitrary function of speed, given by a table from rest to a top speed.";
    const FORMULA: &'static str =
        "-c r(|v|) sgn(v), r linear between 1, r1, r2, r3 at 0, top/4, top/2, top, constant above";
    const SOURCE: &'static str = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis \
                                  tools and compensation methods for the control of machines with friction, Automatica \
                                  30 (1994), section 2";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Friction);
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("c", "friction force at rest", Dimension::OUTPUT),
        EffectParameter::shape(
            "r1",
            "force at a quarter of the top speed divided by that at rest",
            Dimension::ONE,
            [0.0, 100.0],
            InitialGrid::Plain(&[0.7, 1.5]),
        ),
        EffectParameter::shape(
            "r2",
            "force at half the top speed divided by that at rest",
            Dimension::ONE,
            [0.0, 100.0],
            InitialGrid::Plain(&[0.7, 2.5]),
        ),
        EffectParameter::shape(
            "r3",
            "force at the top speed divided by that at rest",
            Dimension::ONE,
            [0.0, 100.0],
            InitialGrid::Plain(&[1.0, 4.0]),
        ),
        EffectParameter::shape(
            "top",
            "top speed of the table",
            Dimension::SPEED,
            NOT_NEGATIVE,
            InitialGrid::Scaled(&[2.0]),
        )
        .kept(),
    ];
    const RARITY: u8 = 2;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { c: s[0], r1: s[1], r2: s[2], r3: s[3], top: s[4] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, _: &PortState<'_, S>, _: &[S]) -> S {
        S::from(0.0)
    }

    fn friction(&self, at: &PortState<'_, S>, _: &[S]) -> Option<DryFriction<S>> {
        let points =
            [(S::from(0.0), S::from(1.0)), (self.top * 0.25, self.r1), (self.top * 0.5, self.r2), (self.top, self.r3)];
        let speed = at.v.abs();
        let piece = points.windows(2).find(|pair| speed.value() < pair[1].0.value());
        let ratio = piece.map_or(self.r3, |pair| {
            let ((v0, r0), (v1, r1)) = (pair[0], pair[1]);
            r0 + (r1 - r0) * (speed - v0) / (v1 - v0)
        });
        let sliding = [self.c * ratio; 2];
        Some(DryFriction { sliding, limit: [self.c; 2] })
    }
}
