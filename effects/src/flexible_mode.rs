//! Flexible mode: a mass attached to a joint by a spring.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::NOT_NEGATIVE;

/// Effect `flexible-mode`.
pub struct FlexibleMode;

/// Effect at given parameters.
struct AtParameters<S> {
    m: S,
    w: S,
    d: S,
}

impl Definition for FlexibleMode {
    const NAME: &'static str = "flexible-mode";
    const ABOUT: &'static str = "A second mass attached to the joint by a spring and a damper, which adds a resonance.";
    const FORMULA: &'static str = "m (w^2 (z - q) + 2 d w (z' - v)), z'' = -w^2 (z - q) - 2 d w (z' - v)";
    const SOURCE: &'static str = "J. P. Den Hartog, Mechanical Vibrations, 4th edition (McGraw-Hill 1956), section 3.3";
    const CLASS: EffectClass = EffectClass::Inertial;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive(
            "m",
            "attached mass or inertia",
            Dimension::OUTPUT.over(Dimension::SPEED).over(Dimension::PER_TIME),
        ),
        EffectParameter::shape(
            "w",
            "natural frequency of the attached mass with the joint fixed, rad/s",
            Dimension::PER_TIME,
            NOT_NEGATIVE,
            // As far apart as the weaker of the damping ratios lets resonances overlap.
            InitialGrid::Frequencies(0.08),
        )
        .most_is(&["added-mass"]),
        EffectParameter::shape("d", "damping ratio", Dimension::ONE, [0.0, 2.0], InitialGrid::Plain(&[0.02, 0.2])),
    ];
    const STATES: usize = 2;
    const FREE_STARTS: &'static [Dimension] = &[Dimension::POSITION, Dimension::SPEED];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { m: s[0], w: s[1], d: s[2] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn start(&self, at: &PortState<'_, S>, z: &mut [S]) {
        z.copy_from_slice(&[at.q, at.v]);
    }

    fn rates(&self, at: &PortState<'_, S>, z: &[S], dz: &mut [S]) {
        dz.copy_from_slice(&[z[1], -self.pull(at, z)]);
    }

    fn value(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        self.m * self.pull(at, z)
    }
}

impl<S: Scalar> AtParameters<S> {
    /// Returns the force on the joint per attached mass.
    fn pull(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        self.w * self.w * (z[0] - at.q) + self.d * self.w * (z[1] - at.v) * 2.0
    }
}
