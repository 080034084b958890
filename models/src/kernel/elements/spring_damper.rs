//! Spring and damper in parallel.

use mops_language::Scalar;

/// Spring and damper in parallel, with the torque `c (q - rest) + d q'` opposing the joint.
///
/// Source: Modelica Standard Library 2.2, Mechanics.Rotational.SpringDamper.
#[derive(Debug, Clone, Copy)]
pub struct SpringDamper<S> {
    /// Spring constant `c`, N m/rad.
    pub spring: S,
    /// Damping constant `d`, N m s/rad.
    pub damper: S,
    /// Angle at which the spring is relaxed, rad.
    pub rest: S,
}

impl<S: Scalar> SpringDamper<S> {
    /// Creates a spring and damper relaxed at angle 0.
    pub fn new(spring: S, damper: S) -> Self {
        Self { spring, damper, rest: S::from(0.0) }
    }

    /// Returns the torque opposing the joint, N m.
    #[inline]
    pub fn torque(&self, angle: S, speed: S) -> S {
        self.spring * (angle - self.rest) + self.damper * speed
    }

    /// Returns the energy stored in the spring, J.
    pub fn energy(&self, angle: S) -> S {
        let stretch = angle - self.rest;
        self.spring * stretch * stretch * 0.5
    }
}
