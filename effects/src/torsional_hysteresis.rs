//! Spring with hysteresis.

use mops_core::effect::{
    BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, ParameterKind, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::NOT_NEGATIVE;

/// Effect `torsional-hysteresis`.
pub struct TorsionalHysteresis;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    h: S,
    y: S,
}

impl Definition for TorsionalHysteresis {
    const NAME: &'static str = "torsional-hysteresis";
    const ABOUT: &'static str =
        "A spring with hysteresis, such as a flexible gear: the force depends on the last points of reversal.";
    const FORMULA: &'static str = "-k (q + h y z), z' = (v/y) (1 - z sgn(v))";
    const SOURCE: &'static str = "P. R. Dahl, Solid friction damping of mechanical vibrations, AIAA Journal 14 (1976)";
    const CLASS: EffectClass = EffectClass::Elastic;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const ACTS_BETWEEN: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive(
            "k",
            "stiffness along the hysteresis loop",
            Dimension::OUTPUT.over(Dimension::POSITION),
        ),
        EffectParameter::shape(
            "h",
            "stiffness after a reversal divided by that along the loop, minus 1",
            Dimension::ONE,
            NOT_NEGATIVE,
            InitialGrid::Plain(&[0.3, 2.0]),
        )
        .least_is(&["linear-stiffness"]),
        EffectParameter::shape(
            "y",
            "displacement over which the effect of a reversal decays",
            Dimension::POSITION,
            [1e-4, f64::INFINITY],
            InitialGrid::Scaled(&[0.05, 0.3]),
        )
        .most_is(&["linear-stiffness"])
        .of_kind(ParameterKind::BuildUp),
    ];
    const STATES: usize = 1;
    const FREE_STARTS: &'static [Dimension] = &[Dimension::ONE];
    const RARITY: u8 = 2;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], h: s[1], y: s[2] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn rates(&self, at: &PortState<'_, S>, z: &[S], dz: &mut [S]) {
        dz[0] = (at.v - z[0] * at.v.abs()) / self.y;
    }

    fn value(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        -self.k * (at.q + self.h * self.y * z[0])
    }
}
