//! Model with effects at its ports. The result is a model, whose parameters are those of the base model and of the
//! effects.

mod along;
mod contacts;
mod edges;
mod model;
mod place;
mod plant;
mod sensors;
mod sticking;

pub use along::{Along, Moment, Sliding, Tick};
pub use model::WithEffects;
