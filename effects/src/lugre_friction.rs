//! Dry friction of elastic bristles that slip.

use mops_core::effect::{
    BoundEffect, Characteristic, Dimension, EffectClass, EffectParameter, InitialGrid, ParameterKind, PortKind,
    PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::NOT_NEGATIVE;

/// Effect `lugre-friction`.
pub struct LugreFriction;

/// Effect at given parameters.
struct AtParameters<S> {
    c: S,
    rise: S,
    vs: S,
    y: S,
    tau: S,
}

impl Definition for LugreFriction {
    const NAME: &'static str = "lugre-friction";
    const ABOUT: &'static str = "Dry friction modelled by elastic bristles, with a force that decreases with speed.";
    const FORMULA: &'static str = "-c (z + tau z'), z' = (v - |v| z/(1 + rise exp(-(v/vs)^2)))/y";
    const SOURCE: &'static str = "C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky, A new model for control \
                                  of systems with friction, IEEE Transactions on Automatic Control 40 (1995)";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const CHARACTERISTIC: Option<Characteristic> = Some(Characteristic::Friction);
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("c", "friction force at high speed", Dimension::OUTPUT),
        EffectParameter::shape(
            "rise",
            "break-away force divided by the friction force at high speed, minus 1",
            Dimension::ONE,
            NOT_NEGATIVE,
            InitialGrid::Plain(&[0.5]),
        )
        .least_is(&["dahl-friction"]),
        EffectParameter::shape(
            "vs",
            "speed at which the rise has decreased to 1/e",
            Dimension::SPEED,
            NOT_NEGATIVE,
            InitialGrid::Scaled(&[0.05, 0.2]),
        )
        .least_is(&["dahl-friction"])
        .most_is(&["dahl-friction"])
        .of_kind(ParameterKind::BuildUp),
        EffectParameter::shape(
            "y",
            "deflection of the bristles at high speed",
            Dimension::POSITION,
            [1e-4, f64::INFINITY],
            InitialGrid::Scaled(&[0.01, 0.05, 0.2]),
        )
        .least_is(&["stribeck-friction"])
        .most_is(&["linear-stiffness"])
        .of_kind(ParameterKind::BuildUp),
        EffectParameter::shape(
            "tau",
            "damping of the bristles divided by their stiffness",
            Dimension::TIME,
            NOT_NEGATIVE,
            InitialGrid::Scaled(&[0.01]),
        ),
    ];
    const STATES: usize = 1;
    const RARITY: u8 = 2;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { c: s[0], rise: s[1], vs: s[2], y: s[3], tau: s[4] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn rates(&self, at: &PortState<'_, S>, z: &[S], dz: &mut [S]) {
        dz[0] = self.slip(at, z[0]);
    }

    fn value(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        -self.c * (z[0] + self.tau * self.slip(at, z[0]))
    }
}

impl<S: Scalar> AtParameters<S> {
    /// Returns the rate of the deflection.
    fn slip(&self, at: &PortState<'_, S>, z: S) -> S {
        let mut steady = S::from(1.0);
        if self.vs.value() > 0.0 {
            let ratio = at.v / self.vs;
            steady += self.rise * (-(ratio * ratio)).exp();
        }
        (at.v - at.v.abs() * z / steady) / self.y
    }
}
