//! Linear time-invariant systems: poles, zeros, frequency responses, norms, margins, and the design of state feedback.
//!
//! All functions are pure computations on small dense matrices. A request without an answer returns an error of one
//! sentence.

mod banded;
mod bounded_response;
mod columns;
mod components;
mod controllability;
mod delays;
mod disk_margin;
mod eigen;
mod equilibrium;
mod exponential;
mod extended;
mod lyapunov;
mod margins;
mod mask;
mod norms;
mod peaks;
mod place;
mod qr_steps;
#[cfg(test)]
mod reference;
mod response;
mod riccati;
mod sampled;
mod schur;
mod search;
#[cfg(test)]
mod series;
mod stabilising;
mod state_space;
mod system;
#[cfg(test)]
mod testing;
mod transfer;
mod zeros;

pub use banded::Banded;
pub use columns::column_groups;
pub use controllability::check_controllable;
pub use disk_margin::disk_margin;
pub use eigen::{eigenvalues, undecided};
pub use equilibrium::{Balance, NoEquilibrium, equilibrium};
pub use exponential::exponential_m1;
pub use lyapunov::{h2_norm, lyapunov};
pub use margins::{Crossing, Loop};
pub use mask::{Mask, Masked};
pub use norms::{Peak, hinf_norm, peak_gain};
pub use peaks::bandwidth;
pub use place::{Placement, place};
pub use response::FrequencyResponse;
pub use riccati::{lqr, riccati};
pub use sampled::{Clock, NEXT, OWN};
pub use schur::Schur;
pub use state_space::{Complex, StateSpace};
pub use transfer::TransferFunction;
pub use zeros::zeros;
