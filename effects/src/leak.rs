//! Leak of a store.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{CONTENTS, NOT_NEGATIVE};

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
    const QUANTITIES: &'static [&'static str] = CONTENTS;
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

/// Head, relative to the levels, up to which the level is at the hole within rounding.
const CROSSING: f64 = 1e-12;

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let head = at.q - self.hole;
        let flows = !at.closed.unwrap_or(false) && head.value() > 0.0;
        if !flows {
            return S::from(0.0);
        }
        // The derivative of the root is infinite at the hole, but its integral is not: at the crossing itself it counts
        // as 0.
        let crosses = head.value() <= CROSSING * (at.q.value().abs() + self.hole.value().abs());
        -self.k * if crosses { S::from(head.value().sqrt()) } else { head.sqrt() }
    }

    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        (self.k.value() != 0.0).then(|| at.q - self.hole)
    }
}
