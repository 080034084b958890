//! Elements that models are made of: forces, limits and lags, each with the modes it has.
//!
//! An element with modes is smooth in each of them. A model that holds one passes on its guard, which is not negative
//! while the mode holds, and tells it to `switch` when the guard became negative; `settle` finds the mode from scratch,
//! at the start and where an input jumps.

pub mod backlash;
pub mod band;
pub mod bearing_friction;
pub mod dead_zone;
pub mod delay;
pub mod lag;
pub mod piecewise_linear;
pub mod saturation;
pub mod spring_damper;

pub use backlash::Backlash;
pub use bearing_friction::BearingFriction;
pub use dead_zone::DeadZone;
pub use delay::Delay;
pub use lag::Lag;
pub use piecewise_linear::PiecewiseLinear;
pub use saturation::Saturation;
pub use spring_damper::SpringDamper;

#[cfg(test)]
mod tests;
