//! Overflow above a level.

use mops_core::effect::{
    BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, ParameterKind, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::{ANY, CONTENTS, over};

/// Effect `overflow`.
pub struct Overflow;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    level: S,
    n: S,
}

impl Definition for Overflow {
    const NAME: &'static str = "overflow";
    const ABOUT: &'static str = "Outflow over an edge, above its level.";
    const FORMULA: &'static str = "-k max(x - level, 0)^n";
    const SOURCE: &'static str = "V. T. Chow, Open-Channel Hydraulics (McGraw-Hill 1959), chapter 14";
    const CLASS: EffectClass = EffectClass::Flow;
    const PORTS: &'static [PortKind] = &[PortKind::Process];
    const QUANTITIES: &'static [&'static str] = CONTENTS;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("k", "outflow at a level of 1 above the edge", Dimension::OUTPUT)
            .restarted_from(&[1.0, 10.0]),
        EffectParameter::shape(
            "level",
            "level of the edge",
            Dimension::POSITION,
            ANY,
            InitialGrid::Within(&[0.5, 0.7, 0.85, 0.95]),
        )
        .of_kind(ParameterKind::UpperEdge),
        EffectParameter::shape(
            "n",
            "exponent: 1 for a plain edge, 3/2 for a rectangular weir",
            Dimension::ONE,
            [1.0, 2.5],
            InitialGrid::Plain(&[1.0, 1.5]),
        )
        .kept(),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], level: s[1], n: s[2] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.k * over(at.q - self.level, self.n, at.closed)
    }

    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        (self.k.value() != 0.0).then(|| self.level - at.q)
    }
}
