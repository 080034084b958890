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
mod system;
#[cfg(test)]
mod testing;
mod transfer;
mod zeros;

use nalgebra::DMatrix;

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
pub use transfer::TransferFunction;
pub use zeros::zeros;

/// Complex number.
pub type Complex = nalgebra::Complex<f64>;

/// Linear time-invariant system with named states, inputs and outputs:
///
/// ```text
/// dx/dt = A x + B u(t - delay),   y = C x + D u(t - delay)
/// ```
///
/// A sampled system is represented by its bilinear image, see [`StateSpace::sampled`].
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpace {
    /// Matrix `A`, states x states.
    pub a: DMatrix<f64>,
    /// Matrix `B`, states x inputs.
    pub b: DMatrix<f64>,
    /// Matrix `C`, outputs x states.
    pub c: DMatrix<f64>,
    /// Matrix `D`, outputs x inputs.
    pub d: DMatrix<f64>,
    /// Names of the states.
    pub states: Vec<String>,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// Delay of all inputs, s.
    pub delay: f64,
    /// Sampling period of a sampled system, s; `None` for a continuous one.
    pub period: Option<f64>,
}

impl StateSpace {
    /// Returns the system with every matrix and the delay moved by `distance` along a tangent with the same dimensions.
    #[must_use]
    pub fn moved(&self, tangent: &Self, distance: f64) -> Self {
        Self {
            a: &self.a + &tangent.a * distance,
            b: &self.b + &tangent.b * distance,
            c: &self.c + &tangent.c * distance,
            d: &self.d + &tangent.d * distance,
            delay: self.delay + distance * tangent.delay,
            ..self.clone()
        }
    }
}
