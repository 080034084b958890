//! Spring that is stiffer on one side.

use std::f64::consts::PI;

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::ANY;

/// Effect `quadratic-stiffness`.
pub struct QuadraticStiffness;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    rest: S,
}

impl Definition for QuadraticStiffness {
    const NAME: &'static str = "quadratic-stiffness";
    const ABOUT: &'static str =
        "A spring force with a part proportional to the squared displacement, so that one side is stiffer.";
    const FORMULA: &'static str = "-k (q - rest)^2";
    const SOURCE: &'static str = "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations (Wiley 1979), chapter 4";
    const CLASS: EffectClass = EffectClass::Elastic;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const ACTS_BETWEEN: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed(
            "k",
            "force per squared displacement",
            Dimension::OUTPUT.over(Dimension::POSITION.power(2)),
        ),
        // Not fitted, as its estimate would conflict with the stiffness: the force is strongly nonlinear in both.
        EffectParameter::shape(
            "rest",
            "position without force",
            Dimension::POSITION,
            ANY,
            InitialGrid::Plain(&[0.0, PI]),
        )
        .kept(),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], rest: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let d = at.q - self.rest;
        -self.k * d * d
    }
}
