//! Simulated experiments with an effect in them that the study does not declare: what the discrepancy search is tested
//! with. Shares no code with what it tests: own plants, own formulas, own integrator, own fit.
//!
//! A [`Trial`] is a study file, its data files and the truth. [`generate`] makes one from a plant, what is missing in its
//! base model, a size and a seed; the same four give the same bits.

mod bench;
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

pub use draw::Draw;
pub use effects::{Effect, effects};
pub use fit::{Fit, Series, fit};
pub use generate::{Missing, SIZES, generate};
pub use law::{At, Dry, Installed, Law, Spot};
pub use outside::outside;
pub use plant::{Output, Parameter, Place, Plant, Setup};
pub use plants::plants;
pub use simulate::{base_outputs, base_states, outputs};
pub use trial::{Trial, TrueEffect, Truth};
