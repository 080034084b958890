//! Radiation to surroundings whose temperature is an input.

use mops_core::effect::{
    BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, ParameterKind, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::{NOT_NEGATIVE, RADIATION, emission, radiated};

/// Effect `radiation-exchange`.
pub struct RadiationExchange;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    zero: S,
}

impl Definition for RadiationExchange {
    const NAME: &'static str = "radiation-exchange";
    const ABOUT: &'static str = "Heat radiated to surroundings whose temperature is an input.";
    const FORMULA: &'static str = "-k ((T + zero)^4 - (u + zero)^4), u the companion input";
    const SOURCE: &'static str = RADIATION;
    const CLASS: EffectClass = EffectClass::Dissipative;
    const FORM_OF: Option<&'static str> = Some("radiation-loss");
    const PORTS: &'static [PortKind] = &[PortKind::Process];
    const QUANTITIES: &'static [&'static str] = &["K"];
    const SECOND_PORT: Option<PortKind> = Some(PortKind::Actuator);
    const PARAMETERS: &'static [EffectParameter] = &[
        emission(),
        EffectParameter::shape(
            "zero",
            "offset to the absolute temperature of state and input: 0, or 273.15 for degC",
            Dimension::POSITION,
            NOT_NEGATIVE,
            InitialGrid::Zeros(&[0.0, 273.15]),
        )
        .of_kind(ParameterKind::Zero)
        .kept(),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], zero: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -radiated(self.k, at.q, at.other, self.zero)
    }
}
