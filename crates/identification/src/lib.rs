//! Identification: what measured data determine. Numbers only; sentences about them are made in `mops-outcome`.
//!
//! | module | content |
//! |---|---|
//! | [`excitation()`] | order of persistent excitation of an input |
//! | [`least_squares()`], [`Regression`], [`Recursive`] | linear regressions (FIR, ARX), at once and recursively |
//! | [`whiteness()`] | test of residuals, an assumption of standard errors |
//! | [`sensitivity`], [`blind`] | sensitivity matrix of the tuners, and the directions that it leaves open |
//! | [`noise`], [`Covariance`] | noise of the residuals, record by record, and the covariance of estimates that it causes |
//! | [`local()`] | the sensitivities and the covariance of a problem at a point |
//!
//! ```
//! use mops_identification::whiteness;
//!
//! let slow: Vec<f64> = (0..60).map(|i| (0.2 * f64::from(i)).sin()).collect();
//! assert!(!whiteness(&slow).unwrap().is_white());
//! ```

mod alike;
pub mod blind;
mod coordinate;
mod covariance;
mod excitation;
mod least_squares;
mod local;
pub mod noise;
mod pools;
mod records;
mod recursive;
mod regression;
pub mod sensitivity;
mod whiteness;

pub use alike::Alike;
pub use coordinate::Coordinate;
pub use covariance::Covariance;
pub use excitation::{Excitation, excitation};
pub use least_squares::{Estimate, least_squares};
pub use local::{Local, NEGLIGIBLE, Point, counting, local, start_parameters};
pub use records::FAR;
pub use recursive::Recursive;
pub use regression::{Regression, RegressionTooShort};
pub use sensitivity::Sensitivity;
pub use whiteness::{UNLIKELY, Whiteness, whiteness};
