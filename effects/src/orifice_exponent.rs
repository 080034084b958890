//! Outflow with a general exponent.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{CONTENTS, power};

/// Effect `orifice-exponent`.
pub struct OrificeExponent;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    n: S,
}

impl Definition for OrificeExponent {
    const NAME: &'static str = "orifice-exponent";
    const ABOUT: &'static str = "An outflow proportional to a power of the level other than the square root.";
    const FORMULA: &'static str = "-k max(x, 0)^n";
    const SOURCE: &'static str = "F. M. White, Fluid Mechanics, 7th edition (McGraw-Hill 2011), chapter 6 (orifices)";
    const CLASS: EffectClass = EffectClass::Flow;
    const PORTS: &'static [PortKind] = &[PortKind::Process];
    const QUANTITIES: &'static [&'static str] = CONTENTS;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("k", "outflow at a level of 1", Dimension::OUTPUT),
        EffectParameter::shape("n", "exponent", Dimension::ONE, [0.2, 3.0], InitialGrid::Plain(&[0.3, 0.75, 1.5])),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], n: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.k * power(at.q, self.n)
    }
}
