//! Heat that is radiated.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;
use super::terms::{ANY, NOT_NEGATIVE, RADIATION, emission, radiated};

/// `radiation-loss`.
pub struct RadiationLoss;

/// At given strengths.
struct AtStrengths<S> {
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
    const STRENGTHS: &'static [Strength] = &[
        emission(),
        Strength::shape(
            "around",
            "temperature of the surroundings, as the state counts",
            Dimension::POSITION,
            ANY,
            Trials::Within(&[-0.3, 0.0, 0.3]),
        ),
        Strength::shape(
            "zero",
            "what makes the state an absolute temperature: 0, 273.15 for degC, 293.15 above a room",
            Dimension::POSITION,
            NOT_NEGATIVE,
            Trials::Plain(&[0.0, 273.15, 293.15]),
        )
        .kept(),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { k: s[0], around: s[1], zero: s[2] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        -radiated(self.k, at.q, self.around, self.zero)
    }
}
