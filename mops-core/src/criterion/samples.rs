//! Measured samples that the residuals of a criterion compare with.

use crate::criterion::Loss;

/// Samples behind the residuals of a sum-of-squares criterion: one sample per residual, in the same order.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    /// Measured signal.
    pub signal: String,
    /// Index of the first of them among the samples of the signal.
    pub first: usize,
    /// Residual divided by (simulated - measured), for every sample; positive. With a robust loss, that of small
    /// deviations.
    pub weights: Vec<f64>,
    /// Standard deviation of the noise of one sample, in the unit of the signal, if known.
    pub noise: Option<f64>,
    /// Loss of deviations in units of `noise`; one that is not [`Loss::Squares`] has a known noise.
    pub loss: Loss,
}
