//! Uncertainty of a calibration's estimates in `result.json`: profiles, bootstrap and prediction bands.

use schemars::JsonSchema;
use serde::Serialize;

/// Profiles, bootstrap and bands of a calibration.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct UncertaintyReport {
    /// Findings in sentences; names are between backticks.
    pub words: Vec<String>,
    /// Confidence level of all intervals.
    pub level: f64,
    /// Likelihood profiles.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub profiles: Vec<ProfileReport>,
    /// Bootstrap results.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bootstrap: Option<BootstrapReport>,
    /// Bands around predictions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bands: Vec<BandReport>,
}

/// Likelihood profile of an estimate: the sum of squares with this parameter fixed and all others re-estimated.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ProfileReport {
    /// Name of the parameter.
    pub parameter: String,
    /// Unit of the values.
    pub unit: String,
    /// Estimate of the parameter.
    pub value: f64,
    /// Interval within which the likelihood ratio stays below its limit; an end is null if the data do not limit it.
    pub interval: [f64; 2],
    /// Reason for the lower and the upper end: `data`, `bound` (the profile reaches a bound of the tuner first), or
    /// `open`.
    ///
    /// `open` means that the end was not found, because simulations failed on the way or the run was interrupted.
    pub ends: [&'static str; 2],
    /// First-order interval: estimate +- t quantile times standard error; null if the data do not determine the
    /// parameter.
    pub linear_interval: [f64; 2],
    /// Values of the parameter, with the signed root of the likelihood ratio: `(S - S_min)^(1/2) / s`, negative below
    /// the estimate. The points lie on a straight line if the model is linear.
    pub points: Vec<(f64, f64)>,
    /// Limit of that root: the t quantile.
    pub limit: f64,
}

/// Estimates over bootstrap replicates.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct BootstrapReport {
    /// Number of replicates that were estimated.
    pub replicates: usize,
    /// Number of replicates that failed.
    pub failed: usize,
    /// Block length, in samples, of every measured channel.
    pub blocks: Vec<usize>,
    /// Results of every estimate.
    pub parameters: Vec<BootstrapParameter>,
}

/// Estimate over bootstrap replicates.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct BootstrapParameter {
    /// Name of the parameter.
    pub parameter: String,
    /// Unit of all numbers.
    pub unit: String,
    /// Estimate from the measured data.
    pub value: f64,
    /// Mean of the replicates minus the estimate.
    pub bias: f64,
    /// Standard deviation of the replicates.
    pub std_error: f64,
    /// Percentile interval.
    pub interval: [f64; 2],
    /// Estimates of the replicates.
    #[serde(skip)]
    pub draws: Vec<f64>,
}

/// Bands around the prediction of a measured channel, at some of its times.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct BandReport {
    /// Name of the experiment.
    pub experiment: String,
    /// Name of the channel.
    pub channel: String,
    /// Unit of all values.
    pub unit: String,
    /// Times, s.
    pub times: Vec<f64>,
    /// Predicted values.
    pub value: Vec<f64>,
    /// Half-width of the pointwise confidence band of the true response, due to parameter uncertainty.
    pub response: Vec<f64>,
    /// Half-width of the pointwise prediction band of a new measurement, noise included.
    pub measurement: Vec<f64>,
}

mops_outcome::finding!(
    UncertaintyReport,
    "uncertainty",
    "Profiles, bootstrap and bands for the estimates of a calibration."
);
