//! Catalogue of effects that models may lack: one file per effect.
//!
//! An effect is a [`Definition`]: constants that describe the effect, and its formula written once over the scalar.

mod actuator_lag;
mod added_mass;
mod asymmetric_friction;
mod back_emf;
mod backlash;
mod bouc_wen;
mod cogging;
mod constant_force;
mod coulomb_friction;
mod coupling_play;
mod cross_talk;
mod cubic_drag;
mod cubic_stiffness;
mod dahl_friction;
mod damping_drift;
mod damping_step;
mod eccentricity;
mod end_stop;
mod flexible_mode;
mod hidden_store;
mod imbalance;
mod input_asymmetry;
mod input_bias;
mod input_dead_zone;
mod input_delay;
mod input_gain;
mod input_gain_drift;
mod input_gain_step;
mod input_quantisation;
mod input_rate_limit;
mod input_saturation;
mod leak;
mod linear_loss;
mod linear_stiffness;
mod load_dependent_friction;
mod lugre_friction;
mod mass_loss;
mod orifice_exponent;
mod overflow;
mod periodic_disturbance;
mod position_dependent_friction;
mod position_ripple;
mod power_friction;
mod quadratic_drag;
mod quadratic_input;
mod quadratic_loss;
mod quadratic_stiffness;
mod radiation_exchange;
mod radiation_loss;
mod second_order_lag;
mod sensor_bias;
mod sensor_dead_zone;
mod sensor_delay;
mod sensor_drift;
mod sensor_gain;
mod sensor_gap;
mod sensor_lag;
mod sensor_quantisation;
mod sensor_saturation;
mod spill_over;
mod spring_play;
mod stiction;
mod stribeck_friction;
mod tabulated_friction;
mod terms;
mod torque_ripple;
mod torsional_hysteresis;
mod viscous_friction;
mod wind_gust;

/// Names that the definition of an effect needs, to be imported at once.
pub mod prelude {
    pub use crate::{Definition, effect};
    pub use mops_core::effect::{
        BoundEffect, Characteristic, DeclaredTerm, Dimension, DryFriction, EffectClass, EffectParameter, InitialGrid,
        PortKind, PortState,
    };
    pub use mops_language::Scalar;
}

use std::sync::Arc;

use mops_core::{
    Effect,
    effect::{BoundEffect, Characteristic, DeclaredTerm, Dimension, EffectClass, EffectParameter, PortKind},
};
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
    fn form_of(&self) -> Option<&'static str> {
        D::FORM_OF
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

/// Returns all built-in effects, the simplest and most common first.
pub fn effects() -> Vec<Arc<dyn Effect>> {
    vec![
        effect::<coulomb_friction::CoulombFriction>(),
        effect::<viscous_friction::ViscousFriction>(),
        effect::<constant_force::ConstantForce>(),
        effect::<quadratic_drag::QuadraticDrag>(),
        effect::<linear_stiffness::LinearStiffness>(),
        effect::<cubic_stiffness::CubicStiffness>(),
        effect::<sensor_bias::SensorBias>(),
        effect::<input_bias::InputBias>(),
        effect::<input_delay::InputDelay>(),
        effect::<input_saturation::InputSaturation>(),
        effect::<input_dead_zone::InputDeadZone>(),
        effect::<linear_loss::LinearLoss>(),
        effect::<leak::Leak>(),
        effect::<stiction::Stiction>(),
        effect::<stribeck_friction::StribeckFriction>(),
        effect::<input_gain::InputGain>(),
        effect::<actuator_lag::ActuatorLag>(),
        effect::<sensor_gain::SensorGain>(),
        effect::<sensor_delay::SensorDelay>(),
        effect::<sensor_lag::SensorLag>(),
        effect::<sensor_drift::SensorDrift>(),
        effect::<backlash::Backlash>(),
        effect::<periodic_disturbance::PeriodicDisturbance>(),
        effect::<wind_gust::WindGust>(),
        effect::<cogging::Cogging>(),
        effect::<flexible_mode::FlexibleMode>(),
        effect::<overflow::Overflow>(),
        effect::<radiation_loss::RadiationLoss>(),
        effect::<radiation_exchange::RadiationExchange>(),
        effect::<mass_loss::MassLoss>(),
        effect::<added_mass::AddedMass>(),
        effect::<bouc_wen::BoucWen>(),
        effect::<imbalance::Imbalance>(),
        effect::<sensor_dead_zone::SensorDeadZone>(),
        effect::<sensor_saturation::SensorSaturation>(),
        effect::<end_stop::EndStop>(),
        effect::<hidden_store::HiddenStore>(),
        effect::<quadratic_loss::QuadraticLoss>(),
        effect::<orifice_exponent::OrificeExponent>(),
        effect::<asymmetric_friction::AsymmetricFriction>(),
        effect::<cubic_drag::CubicDrag>(),
        effect::<quadratic_stiffness::QuadraticStiffness>(),
        effect::<back_emf::BackEmf>(),
        effect::<quadratic_input::QuadraticInput>(),
        effect::<input_asymmetry::InputAsymmetry>(),
        effect::<input_rate_limit::InputRateLimit>(),
        effect::<second_order_lag::SecondOrderLag>(),
        effect::<torque_ripple::TorqueRipple>(),
        effect::<eccentricity::Eccentricity>(),
        effect::<cross_talk::CrossTalk>(),
        effect::<spill_over::SpillOver>(),
        effect::<spring_play::SpringPlay>(),
        effect::<coupling_play::CouplingPlay>(),
        effect::<sensor_gap::SensorGap>(),
        effect::<position_ripple::PositionRipple>(),
        effect::<load_dependent_friction::LoadDependentFriction>(),
        effect::<position_dependent_friction::PositionDependentFriction>(),
        effect::<power_friction::PowerFriction>(),
        effect::<dahl_friction::DahlFriction>(),
        effect::<lugre_friction::LugreFriction>(),
        effect::<tabulated_friction::TabulatedFriction>(),
        effect::<torsional_hysteresis::TorsionalHysteresis>(),
        effect::<damping_drift::DampingDrift>(),
        effect::<damping_step::DampingStep>(),
        effect::<input_gain_drift::InputGainDrift>(),
        effect::<input_gain_step::InputGainStep>(),
        effect::<input_quantisation::InputQuantisation>(),
        effect::<sensor_quantisation::SensorQuantisation>(),
    ]
}

#[cfg(test)]
mod tests;
