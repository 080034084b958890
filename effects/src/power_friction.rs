//! Friction proportional to a power of the speed.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::{power, sign};

/// Effect `power-friction`.
pub struct PowerFriction;

/// Effect at given parameters.
struct AtParameters<S> {
    c: S,
    p: S,
}

impl Definition for PowerFriction {
    const NAME: &'static str = "power-friction";
    const ABOUT: &'static str =
        "A force against the motion, proportional to a power of the speed, between dry friction and steep drag.";
    const FORMULA: &'static str = "-c |v|^p sgn(v)";
    const SOURCE: &'static str = "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations (Wiley 1979), chapter 3";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Friction);
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("c", "force at a speed of 1", Dimension::OUTPUT),
        EffectParameter::shape("p", "exponent", Dimension::ONE, [0.5, 4.0], InitialGrid::Plain(&[0.5, 1.5, 2.5])),
    ];
    const RARITY: u8 = 2;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { c: s[0], p: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.c * power(at.v.abs(), self.p) * sign(at.v.value())
    }
}
