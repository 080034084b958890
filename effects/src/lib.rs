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
mod definition;
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

use mops_core::Effect;

pub use definition::{Definition, effect};

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
