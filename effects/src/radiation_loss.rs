//! Radiation to the surroundings.

use mops_core::effect::{
    BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, ParameterKind, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::{ANY, NOT_NEGATIVE, RADIATION, emission, radiated};

/// Effect `radiation-loss`.
pub struct RadiationLoss;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    around: S,
    zero: S,
}

impl Definition for RadiationLoss {
    const NAME: &'static str = "radiation-loss";
    const ABOUT: &'static str = "Heat radiated to the surroundings.";
    const FORMULA: &'static str = "-k ((T + zero)^4 - (around + zero)^4)";
    const SOURCE: &'static str = RADIATION;
    const CLASS: EffectClass = EffectClass::Dissipative;
    const PORTS: &'static [PortKind] = &[PortKind::Process];
    const QUANTITIES: &'static [&'static str] = &["K"];
    const PARAMETERS: &'static [EffectParameter] = &[
        emission(),
        EffectParameter::shape(
            "around",
            "temperature of the surroundings, on the scale of the state",
            Dimension::POSITION,
            ANY,
            InitialGrid::Within(&[-0.3, 0.0, 0.3]),
        ),
        EffectParameter::shape(
            "zero",
            "offset to the absolute temperature of the state: 0, 273.15 for degC, 293.15 relative to a room",
            Dimension::POSITION,
            NOT_NEGATIVE,
            InitialGrid::Zeros(&[0.0, 273.15, 293.15]),
        )
        .of_kind(ParameterKind::Zero)
        .kept(),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], around: s[1], zero: s[2] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -radiated(self.k, at.q, self.around, self.zero)
    }
}
