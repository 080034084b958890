//! Heat that is radiated to surroundings whose temperature is an input.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;
use super::terms::NOT_NEGATIVE;

/// `radiation-exchange`.
pub struct RadiationExchange;

/// At given strengths.
struct AtStrengths<S> {
    k: S,
    zero: S,
}

impl Definition for RadiationExchange {
    const NAME: &'static str = "radiation-exchange";
    const ABOUT: &'static str = "Heat radiated to surroundings whose temperature is an input.";
    const FORMULA: &'static str = "-k ((T + zero)^4 - (u + zero)^4), u the companion input";
    const SOURCE: &'static str = "F. P. Incropera, D. P. DeWitt, T. L. Bergman, A. S. Lavine, Fundamentals of Heat and \
                                  Mass Transfer, 6th edition (Wiley 2007), section 1.2.3";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const FORM_OF: Option<&'static str> = Some("radiation-loss");
    const PORTS: &'static [PortKind] = &[PortKind::Process];
    const COMPANION: Option<PortKind> = Some(PortKind::Actuator);
    const STRENGTHS: &'static [Strength] = &[
        Strength::positive(
            "k",
            "emissivity times area times the Stefan-Boltzmann constant",
            Dimension::OUTPUT.over(Dimension::POSITION.power(4)),
        ),
        Strength::shape(
            "zero",
            "what makes state and input absolute temperatures: 0, 273.15 for degC",
            Dimension::POSITION,
            NOT_NEGATIVE,
            Trials::Plain(&[0.0, 273.15]),
        )
        .kept(),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { k: s[0], zero: s[1] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        let fourth = |x: S| x * x * x * x;
        -self.k * (fourth(at.q + self.zero) - fourth(at.other + self.zero))
    }
}
