//! A spring with play.

use mops_core::{Acting, At, Dimension, EffectClass, PortKind, Scalar, Strength, Trials};

use super::Definition;
use super::terms::{NOT_NEGATIVE, clamp};

/// `spring-play`.
pub struct SpringPlay;

/// At given strengths.
struct AtStrengths<S> {
    k: S,
    gap: S,
}

impl Definition for SpringPlay {
    const NAME: &'static str = "spring-play";
    const ABOUT: &'static str = "Play in a declared spring at a joint: within the gap the spring does not pull.";
    const FORMULA: &'static str = "k clamp(q, -gap/2, gap/2), which a spring -k q with play lacks";
    const SOURCE: &'static str =
        "M. Nordin, P.-O. Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002)";
    const CLASS: EffectClass = EffectClass::Elastic;
    const FORM_OF: Option<&'static str> = Some("backlash");
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const STRENGTHS: &'static [Strength] = &[
        Strength::positive("k", "stiffness of the spring that has play", Dimension::OUTPUT.over(Dimension::POSITION)),
        Strength::shape("gap", "width of the gap", Dimension::POSITION, NOT_NEGATIVE, Trials::Scaled(&[0.1, 0.4, 1.0])),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn Acting<S>> {
        Box::new(AtStrengths { k: s[0], gap: s[1] })
    }
}

impl<S: Scalar> Acting<S> for AtStrengths<S> {
    fn value(&self, at: &At<'_, S>, _: &[S]) -> S {
        let half = self.gap * 0.5;
        self.k * clamp(at.q, -half, half)
    }
}
