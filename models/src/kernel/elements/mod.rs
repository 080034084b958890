//! Elements of models: forces, limits and lags, each with its modes.
//!
//! An element is smooth in each of its modes. A model that contains an element passes on its guard, which is not
//! negative while the mode is active. When the guard becomes negative, the model calls `switch`. At the start and where
//! an input jumps, `settle` finds the mode.

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
