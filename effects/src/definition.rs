//! Definition of an effect by constants and a formula.

use std::sync::Arc;

use mops_core::Effect;
use mops_core::effect::{BoundEffect, Characteristic, DeclaredTerm, Dimension, EffectClass, EffectParameter, PortKind};
use mops_language::{Dual7, Scalar};

/// Definition of an effect in its file; see [`Effect`] for the meaning of each item.
pub trait Definition: Send + Sync + 'static {
    /// Value of [`Effect::name`].
    const NAME: &'static str;
    /// Value of [`Effect::about`].
    const ABOUT: &'static str;
    /// Value of [`Effect::formula`].
    const FORMULA: &'static str;
    /// Value of [`Effect::source`].
    const SOURCE: &'static str;
    /// Value of [`Effect::class`].
    const CLASS: EffectClass;
    /// Value of [`Effect::form_of`].
    const FORM_OF: Option<&'static str> = None;
    /// Value of [`Effect::ports`].
    const PORTS: &'static [PortKind];
    /// Value of [`Effect::quantities`].
    const QUANTITIES: &'static [&'static str] = &[];
    /// Value of [`Effect::second_port`].
    const SECOND_PORT: Option<PortKind> = None;
    /// Value of [`Effect::mutual`].
    const MUTUAL: bool = false;
    /// Value of [`Effect::acts_between`].
    const ACTS_BETWEEN: bool = false;
    /// Value of [`Effect::parameters`].
    const PARAMETERS: &'static [EffectParameter];
    /// Value of [`Effect::states`].
    const STATES: usize = 0;
    /// Value of [`Effect::free_starts`].
    const FREE_STARTS: &'static [Dimension] = &[];
    /// Value of [`Effect::hysteresis_states`].
    const HYSTERESIS_STATES: usize = 0;
    /// Value of [`Effect::is_inertial`].
    const IS_INERTIAL: bool = false;
    /// Value of [`Effect::is_one_off`].
    const IS_ONE_OFF: bool = false;
    /// Value of [`Effect::is_over_a_turn`].
    const IS_OVER_A_TURN: bool = false;
    /// Value of [`Effect::is_sum`].
    const IS_SUM: bool = false;
    /// Value of [`Effect::characteristic`].
    const CHARACTERISTIC: Option<Characteristic> = None;
    /// Value of [`Effect::modifies`].
    const MODIFIES: Option<DeclaredTerm> = None;
    /// Value of [`Effect::rarity`].
    const RARITY: u8 = 1;

    /// Creates the effect at given parameters.
    fn make<S: Scalar>(parameters: &[S]) -> Box<dyn BoundEffect<S>>;
}

/// Effect given by its definition.
pub(crate) struct Defined<D>(std::marker::PhantomData<fn() -> D>);

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
    fn form_of(&self) -> Option<&'static str> {
        D::FORM_OF
    }
    fn quantities(&self) -> &'static [&'static str] {
        D::QUANTITIES
    }
    fn second_port(&self) -> Option<PortKind> {
        D::SECOND_PORT
    }
    fn mutual(&self) -> bool {
        D::MUTUAL
    }
    fn acts_between(&self) -> bool {
        D::ACTS_BETWEEN
    }
    fn parameters(&self) -> &'static [EffectParameter] {
        D::PARAMETERS
    }
    fn states(&self) -> usize {
        D::STATES
    }
    fn free_starts(&self) -> &'static [Dimension] {
        D::FREE_STARTS
    }
    fn hysteresis_states(&self) -> usize {
        D::HYSTERESIS_STATES
    }
    fn is_inertial(&self) -> bool {
        D::IS_INERTIAL
    }
    fn is_one_off(&self) -> bool {
        D::IS_ONE_OFF
    }
    fn is_over_a_turn(&self) -> bool {
        D::IS_OVER_A_TURN
    }
    fn is_sum(&self) -> bool {
        D::IS_SUM
    }
    fn characteristic(&self) -> Option<Characteristic> {
        D::CHARACTERISTIC
    }
    fn modifies(&self) -> Option<DeclaredTerm> {
        D::MODIFIES
    }
    fn rarity(&self) -> u8 {
        D::RARITY
    }
    fn bind(&self, parameters: &[f64]) -> Box<dyn BoundEffect<f64>> {
        D::make(parameters)
    }
    fn bind_dual(&self, parameters: &[Dual7]) -> Box<dyn BoundEffect<Dual7>> {
        D::make(parameters)
    }
}

/// Creates an effect from the type that defines it.
pub fn effect<D: Definition>() -> Arc<dyn Effect> {
    Arc::new(Defined::<D>(std::marker::PhantomData))
}
