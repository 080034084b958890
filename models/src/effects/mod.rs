//! The catalogue of effects that models may lack: one file per effect.
//!
//! An effect is a [`Definition`]: constants that describe it, and its formula written once over the scalar.

mod coulomb_friction;
mod viscous_friction;

use std::sync::Arc;

use mops_core::{Acting, Along, Effect, EffectClass, PortKind, Scalar, Strength};

/// What the file of an effect says; see [`Effect`] for the meaning of each.
pub trait Definition: Send + Sync + 'static {
    /// [`Effect::name`].
    const NAME: &'static str;
    /// [`Effect::about`].
    const ABOUT: &'static str;
    /// [`Effect::formula`].
    const FORMULA: &'static str;
    /// [`Effect::source`].
    const SOURCE: &'static str;
    /// [`Effect::class`].
    const CLASS: EffectClass;
    /// [`Effect::ports`].
    const PORTS: &'static [PortKind];
    /// [`Effect::companion`].
    const COMPANION: Option<PortKind> = None;
    /// [`Effect::strengths`].
    const STRENGTHS: &'static [Strength];
    /// [`Effect::states`].
    const STATES: usize = 0;
    /// [`Effect::free_start`].
    const FREE_START: bool = false;
    /// [`Effect::memory`].
    const MEMORY: usize = 0;
    /// [`Effect::is_inertial`].
    const IS_INERTIAL: bool = false;
    /// [`Effect::is_one_off`].
    const IS_ONE_OFF: bool = false;
    /// [`Effect::rarity`].
    const RARITY: u8 = 1;

    /// The effect at these strengths.
    fn make<S: Scalar>(strengths: &[S]) -> Box<dyn Acting<S>>;
}

/// An effect by its definition.
struct Defined<D>(std::marker::PhantomData<fn() -> D>);

impl<D: Definition> Effect for Defined<D> {
    fn name(&self) -> &'static str {
        D::NAME
    }
    fn about(&self) -> &'static str {
        D::ABOUT
    }
    fn formula(&self) -> &'static str {
        D::FORMULA
    }
    fn source(&self) -> &'static str {
        D::SOURCE
    }
    fn class(&self) -> EffectClass {
        D::CLASS
    }
    fn ports(&self) -> &'static [PortKind] {
        D::PORTS
    }
    fn companion(&self) -> Option<PortKind> {
        D::COMPANION
    }
    fn strengths(&self) -> &'static [Strength] {
        D::STRENGTHS
    }
    fn states(&self) -> usize {
        D::STATES
    }
    fn free_start(&self) -> bool {
        D::FREE_START
    }
    fn memory(&self) -> usize {
        D::MEMORY
    }
    fn is_inertial(&self) -> bool {
        D::IS_INERTIAL
    }
    fn is_one_off(&self) -> bool {
        D::IS_ONE_OFF
    }
    fn rarity(&self) -> u8 {
        D::RARITY
    }
    fn act(&self, strengths: &[f64]) -> Box<dyn Acting<f64>> {
        D::make(strengths)
    }
    fn act_along(&self, strengths: &[Along]) -> Box<dyn Acting<Along>> {
        D::make(strengths)
    }
}

/// An effect, by the type that defines it.
pub fn effect<D: Definition>() -> Arc<dyn Effect> {
    Arc::new(Defined::<D>(std::marker::PhantomData))
}

/// Every effect that is shipped.
pub fn effects() -> Vec<Arc<dyn Effect>> {
    vec![effect::<coulomb_friction::CoulombFriction>(), effect::<viscous_friction::ViscousFriction>()]
}
