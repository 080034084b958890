//! Hidden store of heat or matter.

use mops_core::effect::{BoundEffect, Dimension, EffectClass, EffectParameter, InitialGrid, PortKind, PortState};
use mops_language::Scalar;

use super::Definition;
use super::terms::{NOT_NEGATIVE, STORED};

/// Effect `hidden-store`.
pub struct HiddenStore;

/// Effect at given parameters.
struct AtParameters<S> {
    k: S,
    tau: S,
}

impl Definition for HiddenStore {
    const NAME: &'static str = "hidden-store";
    const ABOUT: &'static str =
        "A second store of heat or matter that exchanges with this one, such as walls or a dead volume.";
    const FORMULA: &'static str = "k (z - x), z' = (x - z)/tau";
    const SOURCE: &'static str = "P. Bacher, H. Madsen, Identifying suitable models for the heat dynamics of \
                                  buildings, Energy and Buildings 43 (2011)";
    const CLASS: EffectClass = EffectClass::Flow;
    const PORTS: &'static [PortKind] = &[PortKind::Process];
    const QUANTITIES: &'static [&'static str] = STORED;
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::positive("k", "exchange per difference", Dimension::OUTPUT.over(Dimension::POSITION)),
        EffectParameter::shape(
            "tau",
            "time constant of the hidden store",
            Dimension::TIME,
            NOT_NEGATIVE,
            InitialGrid::Scaled(&[0.3, 1.0, 3.0, 10.0]),
        ),
    ];
    const STATES: usize = 1;
    const FREE_STARTS: &'static [Dimension] = &[Dimension::POSITION];

    fn make<S: Scalar>(s: &[S]) -> Box<dyn BoundEffect<S>> {
        Box::new(AtParameters { k: s[0], tau: s[1] })
    }
}

impl<S: Scalar> BoundEffect<S> for AtParameters<S> {
    fn start(&self, at: &PortState<'_, S>, z: &mut [S]) {
        z[0] = at.q;
    }

    fn rates(&self, at: &PortState<'_, S>, z: &[S], dz: &mut [S]) {
        dz[0] = if self.tau.value() > 0.0 { (at.q - z[0]) / self.tau } else { S::from(0.0) };
    }

    fn value(&self, at: &PortState<'_, S>, z: &[S]) -> S {
        self.k * (z[0] - at.q)
    }
}
