//! Simulated experiments with an effect that the study does not declare, to test the diagnosis. Shares no code
//! with the search: own plants, formulas, integrator and fit.
//!
//! A [`Trial`] is a study file, its data files and the truth. [`generate`] creates one from a plant, the effects
//! missing in its baseline model, a size and a seed; the same four arguments give identical bits.
//! [`disturbed`] creates one with a model error in the background.

mod background;
mod bench;
mod disturbed;
mod draw;
mod effects;
mod excitation;
mod fit;
mod generate;
mod law;
mod outside;
mod places;
mod plant;
mod plants;
mod simulate;
mod span;
mod strength;
mod study;
mod trial;
pub mod twins;

pub use disturbed::{NOMINAL, Nominal, Setting, disturbed};
pub use draw::Draw;
pub use effects::{Effect, effects};
pub use fit::{Fit, Series, fit};
pub use generate::{Missing, SIZES, generate};
pub use law::{At, Dry, Installed, Law, Spot};
pub use outside::outside;
pub use plant::{Output, Parameter, Place, Plant, Setup};
pub use plants::{disturbed_plants, further_plants, plants};
pub use simulate::{base_outputs, base_states, outputs};
pub use trial::{Disturbance, Trial, TrueEffect, Truth};
