//! The effect `eddy-brake`.

use mops::effects::prelude::*;

/// A braking force that is largest at a critical speed: `-2 b (v/vc)/(1 + (v/vc)^2)`.
pub struct EddyBrake;

impl Definition for EddyBrake {
    const NAME: &'static str = "eddy-brake";
    const ABOUT: &'static str = "A braking force that is largest at a critical speed.";
    const FORMULA: &'static str = "-2 b (v/vc)/(1 + (v/vc)^2)";
    const SOURCE: &'static str = "W. R. Smythe, Trans. AIEE 61 (1942) 681-684";
    const CLASS: EffectClass = EffectClass::Dissipative;
    const PORTS: &'static [PortKind] = &[PortKind::Joint];
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("b", "largest braking force", Dimension::OUTPUT),
        EffectParameter::positive("vc", "critical speed", Dimension::SPEED),
    ];
    const RARITY: u8 = 2;

    fn make<S: Scalar>(p: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(WithParameters { b: p[0], vc: p[1] })
    }
}

/// The effect with its parameters.
struct WithParameters<S> {
    b: S,
    vc: S,
}

impl<S: Scalar> BoundEffect<S> for WithParameters<S> {
    fn value(&self, at: &PortState<'_, S>, _: &[S]) -> S {
        let ratio = at.v / self.vc;
        -self.b * ratio * 2.0 / (ratio * ratio + 1.0)
    }
}
