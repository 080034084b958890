//! Force with hysteresis.

use mops_core::effect::{
    BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, ParameterKind, PortKind, PortState,
};
use mops_language::Scalar;

use super::Definition;
use super::terms::{power, sign};

/// Effect `bouc-wen`.
pub struct BoucWen;

/// Effect at given parameters.
struct AtParameters<S> {
    c: S,
    y: S,
    sigma: S,
    n: S,
}

impl Definition for BoucWen {
    const NAME: &'static str = "bouc-wen";
    const ABOUT: &'static str =
        "A restoring force with hysteresis that is elastic for small displacements and yields towards a limit.";
    const FORMULA: &'static str = "-c z, z' = (v - sigma |v| |z|^(n-1) z + (sigma - 1) v |z|^n)/y";
    const SOURCE: &'static str = "R. Bouc, Forced vibration of mechanical systems with hysteresis, Proc. 4th Conf. on \
                                  Nonlinear Oscillation, Prague (1967); Y.-K. Wen, Method for random vibration of \
                                  hysteretic systems, Journal of the Engineering Mechanics Division 102 (1976); \
                                  normalised as in M. Ismail, F. Ikhouane, J. Rodellar, The hysteresis Bouc-Wen model, \
                                  a survey, Archives of Computational Methods in Engineering 16 (2009)";
    const CLASS: EffectClass = EffectClass::Elastic;
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const ACTS_BETWEEN: bool = true;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("c", "yield force", Dimension::OUTPUT),
        EffectParameter::shape(
            "y",
            "displacement over which the force builds up",
            Dimension::POSITION,
            [1e-4, f64::INFINITY],
            InitialGrid::Scaled(&[0.05, 0.2, 0.7, 2.0]),
        )
        .least_is(&["coulomb-friction"])
        .most_is(&["linear-stiffness"])
        .of_kind(ParameterKind::BuildUp),
        EffectParameter::shape(
            "sigma",
            "1/2: elastic unloading; larger: energy is dissipated immediately",
            Dimension::ONE,
            [0.5, 10.0],
            InitialGrid::Plain(&[0.5, 1.0]),
        ),
        EffectParameter::shape(
            "n",
            "sharpness of the transition to yielding",
            Dimension::ONE,
            [1.0, 10.0],
            InitialGrid::Plain(&[1.0, 2.0]),
        ),
    ];
    const STATES: usize = 1;
    const FREE_STARTS: &'static [Dimension] = &[Dimension::ONE];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { c: s[0], y: s[1], sigma: s[2], n: s[3] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn rates(&self, at: &PortState<'_, S>, z: &[S], dz: &mut [S]) {
        let full = power(z[0].abs(), self.n);
        let against = self.sigma * at.v.abs() * full * sign(z[0].value());
        dz[0] = (at.v - against + (self.sigma - 1.0) * at.v * full) / self.y;
    }

    fn value(&self, _: &PortState<'_, S>, z: &[S]) -> S {
        -self.c * z[0]
    }
}
