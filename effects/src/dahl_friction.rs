//! Dry friction with elastic presliding.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, EffectClass, EffectParameter, InitialGrid, ParameterKind, PortKind,
    PortState,
};
use mops_language::Scalar;

use super::Definition;

/// Effect `dahl-friction`.
pub struct DahlFriction;

/// Effect at given parameters.
struct AtParameters<S> {
    c: S,
    y: S,
}

impl Definition for DahlFriction {
    const NAME: &'static str = "dahl-friction";
    const ABOUT: &'static str = "Dry friction that builds up over a small displacement, like a yielding spring.";
    const FORMULA: &'static str = "-c z, z' = (v/y) (1 - z sgn(v))";
    const SOURCE: &'static str =
        "P. R. Dahl, A solid friction model, report TOR-0158(3107-18)-1, The Aerospace Corporation (1968)";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Friction);
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("c", "friction force", Dimension::OUTPUT),
        EffectParameter::shape(
            "y",
            "displacement over which the force builds up",
            Dimension::POSITION,
            [1e-4, f64::INFINITY],
            InitialGrid::Scaled(&[0.01, 0.05, 0.2]),
        )
        .least_is(&["coulomb-friction"])
        .of_kind(ParameterKind::BuildUp),
    ];
    const STATES: usize = 1;
    const RARITY: u8 = 2;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { c: s[0], y: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn rates(&self, at: &PortState<'_, S>, z: &[S], dz: &mut [S]) {
        dz[0] = (at.v - z[0] * at.v.abs()) / self.y;
    }

    fn value(&self, _: &PortState<'_, S>, z: &[S]) -> S {
        -self.c * z[0]
    }
}
