//! Elastic coupling with backlash.

use mops_core::effect::{
    BoundEffect, DeclaredTerm, Dimension, EffectClass, EffectParameter, InitialGrid, ParameterKind, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::{NOT_NEGATIVE, Pressed};

/// Effect `coupling-play`.
pub struct CouplingPlay;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    gap: S,
    tau: S,
}

impl Definition for CouplingPlay {
    const NAME: &'static str = "coupling-play";
    const ABOUT: &'static str = "Backlash in an elastic coupling of two joints that the model declares: within the gap \
                                 its stiffness k and damping k tau transmit nothing, and contact never pulls.";
    const FORMULA: &'static str = "k (e + tau e' - c) with c = max(e - gap/2 + tau e', 0) for e = q - q2 > gap/2, \
                                   min(e + gap/2 + tau e', 0) for e < -gap/2, else 0, and the reaction at the \
                                   companion joint: the difference between a coupling with backlash and the \
                                   coupling -k (e + tau e')";
    const SOURCE: &'static str = "Modelica Standard Library 4.0, Modelica.Mechanics.Rotational.Components.ElastoBacklash2: \
                                  contact is regained where it was lost, without the relaxation of a damped shaft \
                                  in the gap";
    const CLASS: EffectClass = EffectClass::Elastic;
    const FORM_OF: Option<&'static str> = Some("backlash");
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const SECOND_PORT: Option<PortKind> = Some(PortKind::Joint);
    const MUTUAL: bool = true;
    const MODIFIES: Option<DeclaredTerm> = Some(DeclaredTerm::Spring);
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive(
            "k",
            "stiffness of the coupling with backlash",
            Dimension::OUTPUT.over(Dimension::POSITION),
        ),
        EffectParameter::shape(
            "gap",
            "width of the gap",
            Dimension::POSITION,
            NOT_NEGATIVE,
            InitialGrid::Scaled(&[0.1, 0.4, 1.0, 2.0]),
        ),
        EffectParameter::shape(
            "tau",
            "damping of the coupling that acts only in contact, divided by its stiffness",
            Dimension::TIME,
            NOT_NEGATIVE,
            InitialGrid::Plain(&[0.0]),
        )
        .of_kind(ParameterKind::Damping),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], gap: s[1], tau: s[2] })
    }
}

impl<S: Scalar> AtParameters<S> {
    /// Returns the contact on the side on which one joint leads the other, and the sign of that side.
    fn nearer(&self, at: &PortState<'_, S>) -> (Pressed<S>, f64) {
        let (ahead, faster) = (at.q - at.other, at.v - at.other_speed);
        let side = if ahead.value() < 0.0 { -1.0 } else { 1.0 };
        (Pressed { into: ahead * side - self.gap * 0.5, damped: self.tau * faster * side }, side)
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let (pressed, side) = self.nearer(at);
        let coupled = at.q - at.other + self.tau * (at.v - at.other_speed);
        self.k * (coupled - pressed.force(at.closed) * side)
    }

    fn onward(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        -self.value(at, z)
    }

    fn gap(&self, at: &PortState<'_, S>) -> Option<S> {
        (self.k.value() != 0.0).then(|| self.nearer(at).0.gap())
    }
}
