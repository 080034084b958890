//! Measurements, with which simulations are compared.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use mops_language::Unit;

/// Role of an experiment.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Used to estimate parameters.
    #[default]
    Calibration,
    /// Used to choose between models, but not to estimate parameters.
    Selection,
    /// Reported only.
    Validation,
}

impl Role {
    /// Returns the name of the role in study files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Calibration => "calibration",
            Self::Selection => "selection",
            Self::Validation => "validation",
        }
    }
}

/// A measured signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Signal of the model that is measured.
    pub signal: String,
    /// Times of the samples, s, increasing; channels may have different times.
    pub times: Vec<f64>,
    /// Samples, in the unit of the signal; missing samples are omitted.
    pub values: Vec<f64>,
    /// Standard deviation of the noise, in the unit of the signal, if known.
    pub noise: Option<f64>,
}

/// A measured frequency response.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ResponseData {
    /// Output: a signal of a linear model.
    pub signal: String,
    /// Angular frequencies, rad/s.
    pub frequencies: Vec<f64>,
    /// Real and imaginary part at each frequency; missing values are omitted.
    pub values: Vec<[f64; 2]>,
    /// Unit of the values. `None` for the unit of the output divided by that of the input, and in a built study.
    pub unit: Option<Unit>,
}

/// A measurement: recorded signals and their role.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Experiment {
    /// Measured signals.
    pub channels: Vec<Channel>,
    /// Measured frequency responses.
    pub responses: Vec<ResponseData>,
    /// Role of the experiment.
    pub role: Role,
}

impl Experiment {
    /// Returns the channel that measures `signal`.
    pub fn channel(&self, signal: &str) -> Option<&Channel> {
        self.channels.iter().find(|channel| channel.signal == signal)
    }

    /// Returns the frequency response with the output `signal`.
    pub fn response(&self, signal: &str) -> Option<&ResponseData> {
        self.responses.iter().find(|response| response.signal == signal)
    }

    /// Returns the time of the last sample of all channels, s.
    pub fn end(&self) -> f64 {
        self.channels.iter().filter_map(|c| c.times.last().copied()).fold(0.0, f64::max)
    }
}
