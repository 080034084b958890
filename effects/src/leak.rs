//! Leak of a store.

use mops_core::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState, Scalar};

use super::Definition;
use super::terms::NOT_NEGATIVE;

/// Effect `leak`.
pub struct Leak;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    hole: S,
}

impl Definition for Leak {
    const NAME: &'static str = "leak";
    const ABOUT: &'static str = "Outflow through a hole, proportional to the square root of the level above it.";
    const FORMULA: &'static str = "-k sqrt(max(x - hole, 0))";
    const SOURCE: &'static str = "F. M. White, Fluid Mechanics, 7th edition (McGraw-Hill 2011), chapter 3 (Torricelli)";
    const CLASS: EffectClass = EffectClass::Flow;
    const PORTS: &'static [PortKind] = &[PortKind::Process];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("k", "outflow at a level of 1 above the hole", Dimension::OUTPUT),
        EffectParameter::shape(
            "hole",
            "level of the hole",
            Dimension::POSITION,
            NOT_NEGATIVE,
            InitialGrid::Within(&[-0.3, 0.0, 0.3, 0.6]),
        ),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], hole: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let head = at.q - self.hole;
        if head.value() > 0.0 { -self.k * head.sqrt() } else { S::from(0.0) }
    }
}
