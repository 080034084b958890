//! What is told of the uncertainty of a calibration's estimates besides standard errors, as it stands in `result.json`.

use serde::Serialize;

/// Profiles, bootstrap and bands of a calibration.
#[derive(Debug, Clone, Serialize)]
pub struct UncertaintyReport {
    /// The findings in sentences; names stand between backticks.
    pub words: Vec<String>,
    /// Confidence of all intervals.
    pub level: f64,
    /// Profiles of the likelihood.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub profiles: Vec<ProfileReport>,
    /// The bootstrap.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bootstrap: Option<BootstrapReport>,
    /// Bands around predictions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bands: Vec<BandReport>,
}

/// The profile of an estimate: the sum of squares with this parameter held, all others estimated again.
#[derive(Debug, Clone, Serialize)]
pub struct ProfileReport {
    /// The parameter.
    pub parameter: String,
    /// Unit of its values.
    pub unit: String,
    /// The estimate.
    pub value: f64,
    /// The interval within which the likelihood ratio stays below its limit; an end is null where the data set none.
    pub interval: [f64; 2],
    /// What ends the interval below and above: `data`, `bound` (the profile meets a bound of the tuner first), or `open`
    /// (the end was not found: simulations failed on the way to it, or the run was interrupted).
    pub ends: [&'static str; 2],
    /// The interval to first order: estimate +- t quantile times standard error; null where the data do not determine the
    /// parameter.
    pub linear_interval: [f64; 2],
    /// Value of the parameter, and the signed root of the likelihood ratio: `(S - S_min)^(1/2) / s`, negative below the
    /// estimate; on a straight line where the model is linear.
    pub points: Vec<(f64, f64)>,
    /// The limit of that root: the t quantile.
    pub limit: f64,
}

/// Estimates over bootstrap replicates.
#[derive(Debug, Clone, Serialize)]
pub struct BootstrapReport {
    /// Replicates that could be estimated.
    pub replicates: usize,
    /// Those that could not.
    pub failed: usize,
    /// Length of a block, in samples, of every measured channel.
    pub blocks: Vec<usize>,
    /// Every estimate.
    pub parameters: Vec<BootstrapParameter>,
}

/// An estimate over bootstrap replicates.
#[derive(Debug, Clone, Serialize)]
pub struct BootstrapParameter {
    /// The parameter.
    pub parameter: String,
    /// Unit of all numbers.
    pub unit: String,
    /// The estimate from the data as measured.
    pub value: f64,
    /// Mean of the replicates less the estimate.
    pub bias: f64,
    /// Standard deviation of the replicates.
    pub std_error: f64,
    /// Percentile interval.
    pub interval: [f64; 2],
    /// The replicates.
    #[serde(skip)]
    pub draws: Vec<f64>,
}

/// Bands around the prediction of a measured channel, at some of its times.
#[derive(Debug, Clone, Serialize)]
pub struct BandReport {
    /// The experiment.
    pub experiment: String,
    /// The channel.
    pub channel: String,
    /// Unit of all values.
    pub unit: String,
    /// Times, s.
    pub times: Vec<f64>,
    /// The prediction.
    pub value: Vec<f64>,
    /// Half the width of the band in which the true response lies, point by point, as far as parameters are uncertain.
    pub response: Vec<f64>,
    /// Half the width of the band in which a new measurement lies, noise included.
    pub measurement: Vec<f64>,
}
