//! Mass that decreases with time.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, MOST_LOST, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;

/// Effect `mass-loss`.
pub struct MassLoss;

/// Effect at given parameters.
struct AtParameters<S> {
    r: S,
}

impl Definition for MassLoss {
    const NAME: &'static str = "mass-loss";
    const ABOUT: &'static str =
        "Mass or inertia that decreases linearly with time, such as fuel or water flowing out without thrust.";
    const FORMULA: &'static str = "r t q''; the loss is limited to 95 % of the moving mass";
    const SOURCE: &'static str = "F. O. Eke, Dynamics of variable mass systems, NASA/CR-1998-208246 (1998)";
    const CLASS: EffectClass = EffectClass::TimeVarying;
    const PORTS: &'static [PortKind] = &[PortKind::Joint, PortKind::Speed];
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::positive("r", "mass or inertia lost per time", Dimension::OUTPUT.over(Dimension::SPEED))];
    const IS_INERTIAL: bool = true;

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { r: s[0] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        // The lost mass as a fraction of the moving mass, limited so that some mass remains.
        let gone = self.r * at.t;
        let left = -gone * at.mobility + 1.0;
        if left.value() > 1.0 - MOST_LOST {
            gone * at.a / left
        } else {
            at.a / at.mobility * (MOST_LOST / (1.0 - MOST_LOST))
        }
    }

    fn inertia(&self, at: &PortState<'_, S>) -> S {
        -self.r * at.t
    }
}
