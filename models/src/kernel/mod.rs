//! Simulation kernel: adaptive Runge-Kutta methods with dense output, event location, and the elements that models are
//! built from.

mod attempt;
mod by_size;
mod dormand_prince;
pub mod drive;
mod driven;
pub mod elements;
mod esdirk;
mod events;
mod explicit;
pub mod friction;
mod inputs;
mod instants;
mod integrable;
mod integrate;
mod local;
pub mod mechanism;
mod method;
mod past;
mod plant_model;
mod record;
mod simulated;
mod sink;
mod step;
mod step_size;
mod weights;
mod with_inputs;

pub use mops_core::plant::{IntegrationMethod, Tolerance};

pub use driven::Driven;
pub(crate) use driven::mobility;
pub use inputs::Inputs;
pub use instants::seconds;
pub(crate) use instants::{common, is_due, latest, next_of};
pub use integrable::Integrable;
pub use integrate::integrate;
pub(crate) use integrate::integrate_for;
pub(crate) use local::rests;
pub use plant_model::PlantModel;
pub(crate) use plant_model::shown;
pub use record::{Recording, Wanted, record};
pub(crate) use record::{allowed, tangents_of, wanted};
pub use simulated::Simulated;
pub(crate) use simulated::{Simulation, cut_at};
pub use sink::{Integrated, Sink};
pub use step::Step;
pub use step_size::StepSizes;
