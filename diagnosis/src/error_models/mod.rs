//! Gaussian-process models of residuals, with exact likelihoods.
//!
//! Three error models are compared, because none describes every recording: a smooth (Matern-3/2) or a rough
//! (Ornstein-Uhlenbeck) error at the output of each channel, and a smooth force at the balances of the plant. Each has
//! white noise of the sensors on top, which is its limit for vanishing deviations. All are Kalman filters, whose effort
//! grows linearly with the number of samples.
//!
//! Source: M. Kennedy, A. O'Hagan, Bayesian calibration of computer models, J. R. Statist. Soc. B 63 (2001) 425; N.
//! Kristensen, H. Madsen, S. Jorgensen, Parameter estimation in stochastic grey-box models, Automatica 40 (2004) 225.

mod force_error;
mod likelihood;
mod output_error;
mod process;
#[cfg(test)]
mod tests;

pub use force_error::{ForceError, LinearisedMotion, Measured};
pub use output_error::{Kernel, OutputError};
