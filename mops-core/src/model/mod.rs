//! Models: signals, parameters, states, inputs, and the analysis that criteria read.

mod analysis;
mod contract;
mod interface;
mod joined;
mod linearised;
mod roughness;

pub use joined::Joined;
pub use linearised::{Linearise, Linearised, Resting, Rough};

pub use analysis::{Analysis, Event, Response, WithTangents, Work};
pub use contract::{Cut, Job, Local, Model, OperatingPoint};
pub use interface::{AnalysisKind, Interface, Parameter, State, Variable};
