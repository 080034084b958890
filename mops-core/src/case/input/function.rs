//! Inputs as functions of time.

use mops_language::enclosure::Enclosure;
use mops_language::expression::Function;
use mops_math as math;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::case::band_limited;

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
    /// Sine whose frequency changes from one value to another.
    Chirp(Chirp),
    /// Samples, recorded or computed.
    Sampled {
        /// Times of the samples, s, increasing.
        times: Vec<f64>,
        /// The samples, in the unit of the input; all finite.
        values: Vec<f64>,
        /// Interpolation between the samples.
        hold: Hold,
    },
    /// Sum of inputs.
    Sum(Vec<Input>),
}

/// Sine `amplitude sin(phase(t))` whose frequency changes from one value to another; 0 before its start and after its
/// end.
///
/// Linear sweep: `phase = 2 pi (f1 + (f2 - f1) s/(2 T)) s` with `s = t - start`. Logarithmic sweep, in which equal
/// times have equal frequency ratios: `phase = 2 pi f1 T/ln(f2/f1) ((f2/f1)^(s/T) - 1)`. The frequencies are the
/// derivative of the phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chirp {
    /// Amplitude, in the unit of the input.
    pub amplitude: f64,
    /// Frequencies at the start and at the end, Hz, positive.
    pub frequencies: [f64; 2],
    /// Start, s.
    pub start: f64,
    /// Duration `T` of the sweep, s, positive.
    pub duration: f64,
    /// Time from which the value is 0 again, s; infinite if the simulation ends with the sweep.
    pub end: f64,
    /// True for a logarithmic sweep.
    pub logarithmic: bool,
}

impl Chirp {
    /// Returns the value of the sine at `t`, between its start and its end.
    pub fn sine(&self, t: f64) -> f64 {
        self.amplitude * math::sin(self.phase(t)[0])
    }

    /// Returns the rate of the sine at `t`, per s, between its start and its end.
    pub fn slope(&self, t: f64) -> f64 {
        let [phase, rate] = self.phase(t);
        self.amplitude * math::cos(phase) * rate
    }

    /// Returns bounds of the sine over a time span between its start and its end.
    pub fn enclose(&self, time: Enclosure) -> Enclosure {
        let (s, [from, to]) = (time - Enclosure::from(self.start), self.frequencies);
        let turns = match self.logarithmic && from != to {
            true => {
                let rate = math::ln(to / from) / self.duration;
                let growth = (s * Enclosure::from(rate)).function(Function::Exp);
                (growth - Enclosure::from(1.0)) * Enclosure::from(from / rate)
            }
            false => (s * Enclosure::from(0.5 * (to - from) / self.duration) + Enclosure::from(from)) * s,
        };
        (turns * Enclosure::from(std::f64::consts::TAU)).sin() * Enclosure::from(self.amplitude)
    }

    /// Returns the phase at `t`, rad, and its rate, rad/s.
    pub(super) fn phase(&self, t: f64) -> [f64; 2] {
        let (s, [from, to]) = (t - self.start, self.frequencies);
        let [turns, frequency] = match self.logarithmic && from != to {
            true => {
                let rate = math::ln(to / from) / self.duration;
                let growth = math::exp(rate * s);
                [from * (growth - 1.0) / rate, from * growth]
            }
            false => {
                let rise = (to - from) / self.duration;
                [(from + 0.5 * rise * s) * s, from + rise * s]
            }
        };
        [std::f64::consts::TAU * turns, std::f64::consts::TAU * frequency]
    }
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
            Self::Chirp(chirp) => {
                if (chirp.start..chirp.end).contains(&t) {
                    chirp.sine(t)
                } else {
                    0.0
                }
            }
            Self::Sum(parts) => parts.iter().map(|part| part.at(t)).sum(),
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

    /// Returns the time from which values are known, s, at most 0: the first sample, or 0 for inputs that are not
    /// sampled. What was before it is constant.
    pub fn first_known(&self) -> f64 {
        match self {
            Self::Sampled { times, .. } => times[0].min(0.0),
            Self::Sum(parts) => parts.iter().map(Self::first_known).fold(0.0, f64::min),
            _ => 0.0,
        }
    }

    /// Returns the first time (s) at which the step between samples differs from the mean step by more than 1 %. `None`
    /// for even sampling, and for inputs that need not be evenly sampled.
    pub fn uneven(&self) -> Option<f64> {
        if let Self::Sum(parts) = self {
            return parts.iter().find_map(Self::uneven);
        }
        let Self::Sampled { times, hold: Hold::BandLimited, .. } = self else { return None };
        #[allow(clippy::cast_precision_loss)]
        let mean = (times[times.len() - 1] - times[0]) / (times.len() - 1).max(1) as f64;
        let differs = |pair: &&[f64]| (pair[1] - pair[0] - mean).abs() > band_limited::EVEN * mean;
        times.windows(2).find(differs).map(|pair| pair[0])
    }

    /// Returns true if zero-order-hold samples look like a smooth signal. More than half of the samples must differ
    /// from their predecessor, with a median step below a tenth of the range. Fewer than 20 samples return false.
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
            Self::Chirp(chirp) => [chirp.start, chirp.end].into_iter().find(|time| *time > t).unwrap_or(f64::INFINITY),
            Self::Sum(parts) => parts.iter().map(|part| part.next_break(t)).fold(f64::INFINITY, f64::min),
            Self::Sampled { times, .. } => {
                times.get(times.partition_point(|&time| time <= t)).copied().unwrap_or(f64::INFINITY)
            }
        }
    }

    /// Returns the input with its values mapped by `value`, and its amplitudes, which are differences of values,
    /// multiplied by `factor`.
    #[must_use]
    pub fn mapped(&self, value: &dyn Fn(f64) -> f64, factor: f64) -> Self {
        match self {
            Self::Constant(constant) => Self::Constant(value(*constant)),
            Self::Step { time, before, after } => {
                Self::Step { time: *time, before: value(*before), after: value(*after) }
            }
            Self::Sine { amplitude, frequency, phase, offset } => Self::Sine {
                amplitude: amplitude * factor,
                frequency: *frequency,
                phase: *phase,
                offset: value(*offset),
            },
            Self::Chirp(chirp) => Self::Chirp(Chirp { amplitude: chirp.amplitude * factor, ..*chirp }),
            Self::Sampled { times, values, hold } => {
                Self::Sampled { times: times.clone(), values: values.iter().map(|&v| value(v)).collect(), hold: *hold }
            }
            // The first part has the zero of the unit, the others are differences.
            Self::Sum(parts) => {
                let part = |(k, part): (usize, &Self)| match k {
                    0 => part.mapped(value, factor),
                    _ => part.mapped(&|v| v * factor, factor),
                };
                Self::Sum(parts.iter().enumerate().map(part).collect())
            }
        }
    }

    /// Returns the input on a clock that starts at `from`, s; earlier values have times below 0.
    #[must_use]
    pub fn since(&self, from: f64) -> Self {
        match self {
            Self::Constant(value) => Self::Constant(*value),
            Self::Step { time, before, after } => Self::Step { time: time - from, before: *before, after: *after },
            Self::Sine { amplitude, frequency, phase, offset } => Self::Sine {
                amplitude: *amplitude,
                frequency: *frequency,
                phase: phase + std::f64::consts::TAU * frequency * from,
                offset: *offset,
            },
            Self::Chirp(chirp) => Self::Chirp(Chirp { start: chirp.start - from, end: chirp.end - from, ..*chirp }),
            Self::Sampled { times, values, hold } => {
                // A clock that starts at a sample has this sample at 0, whatever the rounding.
                let later = |t: &f64| if (t - from).abs() <= 1e-12 * (1.0 + from.abs()) { 0.0 } else { t - from };
                Self::Sampled { times: times.iter().map(later).collect(), values: values.clone(), hold: *hold }
            }
            Self::Sum(parts) => Self::Sum(parts.iter().map(|part| part.since(from)).collect()),
        }
    }
}
