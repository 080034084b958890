//! Spring with backlash.

use mops_core::effect::{
    BoundEffect, DeclaredTerm, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::{NOT_NEGATIVE, sign};

/// Effect `spring-play`.
pub struct SpringPlay;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    gap: S,
}

impl Definition for SpringPlay {
    const NAME: &'static str = "spring-play";
    const ABOUT: &'static str =
        "Backlash in a spring at a joint that the model declares: within the gap the spring has no force.";
    const FORMULA: &'static str =
        "k clamp(q, -gap/2, gap/2): the difference between a spring with backlash and the spring -k q";
    const SOURCE: &'static str =
        "M. Nordin, P.-O. Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002)";
    const CLASS: EffectClass = EffectClass::Elastic;
    const FORM_OF: Option<&'static str> = Some("backlash");
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const MODIFIES: Option<DeclaredTerm> = Some(DeclaredTerm::Spring);
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive(
            "k",
            "stiffness of the spring with backlash",
            Dimension::OUTPUT.over(Dimension::POSITION),
        ),
        EffectParameter::shape(
            "gap",
            "width of the gap",
            Dimension::POSITION,
            NOT_NEGATIVE,
            InitialGrid::Scaled(&[0.1, 0.4, 1.0]),
        ),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], gap: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let half = self.gap * 0.5;
        let pressed = at.closed.unwrap_or(at.q.value().abs() > half.value());
        self.k * if pressed { half * sign(at.q.value()) } else { at.q }
    }

    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        (self.k.value() != 0.0).then(|| self.gap * 0.5 - at.q.abs())
    }
}
