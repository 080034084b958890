//! Inputs that drive a model, and measurements for comparison.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::band_limited;
use crate::math;
use crate::unit::Unit;

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

/// Interpolation of a sampled input between its samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// Zero-order hold: the value is constant until the next sample.
    #[default]
    Zero,
    /// First-order hold: linear interpolation between samples.
    First,
    /// Band-limited interpolation: no content above half the sampling frequency. The samples must be evenly spaced.
    BandLimited,
}

impl Hold {
    /// Returns the name in study files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Zero => "zero",
            Self::First => "first",
            Self::BandLimited => "band-limited",
        }
    }
}

/// An input of a model as a function of time.
#[derive(Debug, Clone, PartialEq)]
pub enum Input {
    /// Constant value.
    Constant(f64),
    /// Step: `before` until `time` (s), `after` from then on.
    Step {
        /// Time of the step, s.
        time: f64,
        /// Value before `time`.
        before: f64,
        /// Value from `time` on.
        after: f64,
    },
    /// Sine: `offset + amplitude sin(2 pi frequency t + phase)`.
    Sine {
        /// Amplitude, in the unit of the input.
        amplitude: f64,
        /// Frequency, Hz.
        frequency: f64,
        /// Phase, rad.
        phase: f64,
        /// Mean value.
        offset: f64,
    },
    /// Recorded samples.
    Sampled {
        /// Times of the samples, s, increasing.
        times: Vec<f64>,
        /// The samples, in the unit of the input; all finite.
        values: Vec<f64>,
        /// Interpolation between the samples.
        hold: Hold,
    },
}

impl Input {
    /// Returns the value at time `t`, the right-hand limit at jumps.
    pub fn at(&self, t: f64) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Step { time, before, after } => {
                if t >= *time {
                    *after
                } else {
                    *before
                }
            }
            Self::Sine { amplitude, frequency, phase, offset } => {
                offset + amplitude * math::sin(std::f64::consts::TAU * frequency * t + phase)
            }
            Self::Sampled { times, values, hold } => {
                let after = times.partition_point(|&time| time <= t);
                match (after, hold) {
                    (0, _) => values[0],
                    (k, hold) if k < times.len() && *hold != Hold::Zero => {
                        let s = (t - times[k - 1]) / (times[k] - times[k - 1]);
                        match hold {
                            Hold::BandLimited => band_limited::polynomial(&band_limited::piece(values, k - 1), s).0,
                            _ => values[k - 1] + s * (values[k] - values[k - 1]),
                        }
                    }
                    (k, _) => values[k - 1],
                }
            }
        }
    }

    /// Returns the first time (s) at which the step between samples differs from the mean step by more than 1 %. `None` for
    /// even sampling, and for inputs that need not be evenly sampled.
    pub fn uneven(&self) -> Option<f64> {
        let Self::Sampled { times, hold: Hold::BandLimited, .. } = self else { return None };
        #[allow(clippy::cast_precision_loss)]
        let mean = (times[times.len() - 1] - times[0]) / (times.len() - 1).max(1) as f64;
        let differs = |pair: &&[f64]| (pair[1] - pair[0] - mean).abs() > band_limited::EVEN * mean;
        times.windows(2).find(differs).map(|pair| pair[0])
    }

    /// Returns true if zero-order-hold samples look like a smooth signal. More than half of the samples must differ from
    /// their predecessor, with a median step below a tenth of the range. Fewer than 20 samples return false.
    pub fn looks_smooth(&self) -> bool {
        let Self::Sampled { values, hold: Hold::Zero, .. } = self else { return false };
        let range = values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
            - values.iter().copied().fold(f64::INFINITY, f64::min);
        let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let mut steps: Vec<f64> = steps.filter(|&step| step > 0.0).collect();
        steps.sort_by(f64::total_cmp);
        values.len() >= 20 && 2 * steps.len() > values.len() && steps[steps.len() / 2] < 0.1 * range
    }

    /// Returns the first time after `t` at which the value or its derivative jumps; infinity if there is none.
    pub fn next_break(&self, t: f64) -> f64 {
        match self {
            Self::Constant(_) | Self::Sine { .. } => f64::INFINITY,
            Self::Step { time, .. } => {
                if *time > t {
                    *time
                } else {
                    f64::INFINITY
                }
            }
            Self::Sampled { times, .. } => {
                times.get(times.partition_point(|&time| time <= t)).copied().unwrap_or(f64::INFINITY)
            }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_are_continuous_from_the_right_and_name_their_next_jump() {
        let step = Input::Step { time: 1.0, before: 0.0, after: 2.0 };
        assert_eq!((step.at(0.999), step.at(1.0)), (0.0, 2.0));
        assert_eq!((step.next_break(0.0), step.next_break(1.0)), (1.0, f64::INFINITY));
        let sampled = |hold| Input::Sampled { times: vec![0.0, 1.0, 2.0], values: vec![0.0, 4.0, 6.0], hold };
        assert_eq!((sampled(Hold::Zero).at(0.5), sampled(Hold::First).at(0.5)), (0.0, 2.0));
        assert_eq!((sampled(Hold::Zero).at(1.0), sampled(Hold::First).at(5.0)), (4.0, 6.0));
        assert_eq!(sampled(Hold::Zero).next_break(0.0), 1.0);
    }

    #[test]
    fn a_band_limited_input_passes_through_its_samples_and_wants_them_evenly_spaced() {
        let sampled = |times: Vec<f64>| Input::Sampled {
            values: times.iter().map(|t| math::sin(4.0 * t)).collect(),
            times,
            hold: Hold::BandLimited,
        };
        let even = sampled((0..100).map(|i| 0.2 * f64::from(i)).collect());
        assert!((even.at(10.0) - math::sin(40.0)).abs() < 1e-12 && (even.at(10.1) - math::sin(40.4)).abs() < 1e-4);
        assert_eq!((even.at(-1.0), even.at(99.0)), (0.0, math::sin(4.0 * 0.2 * 99.0)));
        assert_eq!((even.uneven(), sampled(vec![0.0, 0.2, 0.5, 0.6]).uneven()), (None, Some(0.2)));
    }

    #[test]
    fn a_sampled_sine_looks_smooth_and_switching_does_not() {
        let sampled = |hold, value: &dyn Fn(f64) -> f64| Input::Sampled {
            times: (0..200).map(f64::from).collect(),
            values: (0..200).map(|i| value(f64::from(i))).collect(),
            hold,
        };
        assert!(sampled(Hold::Zero, &|t| math::sin(0.1 * t)).looks_smooth());
        assert!(!sampled(Hold::First, &|t| math::sin(0.1 * t)).looks_smooth());
        // Switching, a staircase, and a new value at every sample.
        assert!(!sampled(Hold::Zero, &|t| math::sin(0.1 * t).signum()).looks_smooth());
        assert!(!sampled(Hold::Zero, &|t| math::sin(0.1 * (t / 5.0).floor())).looks_smooth());
        assert!(!sampled(Hold::Zero, &|t| math::sin(t * t)).looks_smooth());
    }
}
