//! Loss proportional to a difference.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::ANY;

/// Effect `linear-loss`.
pub struct LinearLoss;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    around: S,
}

impl Definition for LinearLoss {
    const NAME: &'static str = "linear-loss";
    const ABOUT: &'static str = "A loss or exchange proportional to the difference from the surroundings.";
    const FORMULA: &'static str = "-k (x - around)";
    const SOURCE: &'static str = "F. P. Incropera, D. P. DeWitt, T. L. Bergman, A. S. Lavine, Fundamentals of Heat and \
                                  Mass Transfer, 6th edition (Wiley 2007), section 5.1";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const PORTS: &'static [PortKind] = &[PortKind::Process];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("k", "loss per difference", Dimension::OUTPUT.over(Dimension::POSITION)),
        EffectParameter::shape(
            "around",
            "value of the surroundings",
            Dimension::POSITION,
            ANY,
            InitialGrid::Within(&[-0.5, 0.0, 0.5]),
        )
        .least_is(&["constant-force"])
        .most_is(&["constant-force"]),
    ];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], around: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        -self.k * (at.q - self.around)
    }
}
