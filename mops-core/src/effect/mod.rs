//! Effects: physical effects that a model may lack at one of its ports. Their parameters have null values at
//! which the effect vanishes.

mod between;
mod declaration;
mod interface;
mod place;
mod port;

pub use between::Between;
pub use port::Port;

pub use declaration::{
    Characteristic, DeclaredTerm, Dimension, EffectClass, EffectParameter, InitialGrid, ParameterKind, PortKind, Scope,
};
pub use interface::{BoundEffect, DryFriction, Effect, MOST_LOST, Placement, PortState};
