//! Error model of all records of a fit, with its hyperparameters.

use mops_math as math;
use nalgebra::{DMatrix, DVector};

use super::scoring::{Maximum, Score, maximise};
use crate::error_models::{ForceError, Kernel, LinearisedMotion, OutputError};
use crate::fit::Piece;
use crate::settings::Settings;

/// Smallest noise, as a share of that of the sensor. Basis: the studies.
const LEAST_NOISE: f64 = 0.3;

/// Smallest correlation length, samples. Basis: the studies.
const SHORTEST: f64 = 0.3;

/// Starts of the correlation length, samples. Basis: the studies.
const LENGTHS: [f64; 2] = [1.0, 10.0];

/// Largest correlation length of a rough error, as a share of the longest record. Basis: the studies.
const LONGEST_ROUGH: f64 = 0.25;

/// Range of the deviation of forces, nominal forces. Basis: from none, within the digits of a simulation, to more than
/// moves the plant.
const FORCES: [f64; 2] = [1e-6, 50.0];

/// Range of an output deviation: share of the sensor's noise, and multiple of the larger of residual and noise. Basis:
/// 0.02 adds 4e-4 to the variance, which no record shows; a hundred residuals explain anything.
const OUTPUTS: [f64; 2] = [0.02, 100.0];

/// Kind of an error model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorModel {
    /// Matern-3/2 error at each output.
    SmoothOutput,
    /// Ornstein-Uhlenbeck error at each output.
    RoughOutput,
    /// Smooth force at the balances.
    Force,
}

impl ErrorModel {
    /// All error models.
    pub const ALL: [Self; 3] = [Self::SmoothOutput, Self::RoughOutput, Self::Force];
}

impl Motion {
    /// Returns true if there is no force.
    pub fn is_still(&self) -> bool {
        self.forces.iter().all(|&force| force == 0.0)
    }

    /// Returns what residuals would be without the force, to first order.
    pub fn without_force(&self, residuals: &[f64]) -> Vec<f64> {
        residuals.iter().zip(&self.response).map(|(r, f)| r - f).collect()
    }
}

/// Error model with its hyperparameters. Residuals are in units of the noise of their sensors.
#[derive(Debug, Clone)]
pub enum Errors {
    /// White noise of the declared size: least squares.
    White,
    /// Error at the output of each channel.
    Output(Vec<OutputError>),
    /// Force at the balances, with the motion of each record.
    Force(ForceError, Vec<Motion>),
}

/// Motion of a record under a force at its balances.
#[derive(Debug, Clone, Default)]
pub struct Motion {
    /// Linearisation about the motion under the force.
    pub linearised: LinearisedMotion,
    /// Force at the samples, in nominal forces.
    pub forces: Vec<f64>,
    /// What the force adds to the residuals, to first order.
    pub response: Vec<f64>,
}

/// Channels of the records: for each record the channel of each of its series.
#[derive(Debug, Clone)]
pub struct Channels {
    /// Number of channels.
    pub count: usize,
    of: Vec<Vec<usize>>,
    /// Median time between samples of each channel, s.
    step: Vec<f64>,
    /// Length of the longest record of each channel, s.
    length: Vec<f64>,
}

impl Channels {
    /// Finds the channels of records: series of one signal are one channel.
    pub fn new(pieces: &[Piece]) -> Self {
        let mut signals: Vec<usize> = pieces.iter().flat_map(Piece::signals).collect();
        signals.sort_unstable();
        signals.dedup();
        let channel = |signal: usize| signals.iter().position(|&s| s == signal).expect("it was listed");
        let of = pieces.iter().map(|p| p.series.iter().map(|s| channel(s.signal)).collect()).collect();
        let series = |signal: usize| pieces.iter().flat_map(|p| &p.series).filter(move |s| s.signal == signal);
        let step = |&signal: &usize| {
            let mut steps: Vec<f64> = series(signal).flat_map(|s| s.times.windows(2).map(|t| t[1] - t[0])).collect();
            steps.sort_by(f64::total_cmp);
            steps.get(steps.len() / 2).copied().unwrap_or(1.0)
        };
        let length = |&signal: &usize| {
            let lengths = series(signal).filter_map(|s| Some(s.times.last()? - s.times.first()?));
            lengths.fold(0.0, f64::max)
        };
        Self {
            count: signals.len(),
            of,
            step: signals.iter().map(step).collect(),
            length: signals.iter().map(length).collect(),
        }
    }

    /// Returns the shortest time between samples over all channels, s.
    pub fn shortest_step(&self) -> f64 {
        self.step.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Returns the channel of a series of a record.
    pub fn of(&self, piece: usize, series: usize) -> usize {
        self.of[piece][series]
    }
}

/// Largest number of hyperparameters of a force: with more channels there is no force error.
const WIDEST: usize = 16;

/// Residuals of all records, to which an error model is fitted.
#[derive(Clone, Copy)]
pub struct Observed<'a> {
    /// The records.
    pub pieces: &'a [Piece],
    /// Their channels.
    pub channels: &'a Channels,
    /// Residuals of each record, in noises.
    pub residuals: &'a [Vec<f64>],
    /// Priors of the hyperparameters.
    pub settings: &'a Settings,
}

/// Hyperparameters that were fitted, with what the evidence needs of them.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The error model.
    pub errors: Errors,
    /// Number of hyperparameters.
    pub count: usize,
    /// Logarithm of the density of their prior.
    pub log_prior: f64,
    /// Logarithm of the determinant of their information, that of the prior included.
    pub log_determinant: f64,
}

impl Errors {
    /// Returns the standard deviation of the white noise of a channel in units of that of its sensor.
    pub fn noise(&self, channel: usize) -> f64 {
        match self {
            Self::White => 1.0,
            Self::Output(errors) => errors[channel].noise,
            Self::Force(error, _) => error.noise[channel],
        }
    }

    /// Whitens columns over the residuals of a record in place; returns the sum of `ln S + ln 2 pi`.
    pub fn whiten(&self, piece: &Piece, channels: &Channels, index: usize, columns: &mut [Vec<f64>]) -> f64 {
        match self {
            Self::White => {
                let count: usize = piece.series.iter().map(|s| s.times.len()).sum();
                #[allow(clippy::cast_precision_loss)]
                let sum = count as f64 * math::ln(std::f64::consts::TAU);
                sum
            }
            Self::Output(errors) => {
                let (mut from, mut sum) = (0, 0.0);
                for (k, series) in piece.series.iter().enumerate() {
                    let to = from + series.times.len();
                    let parts = columns.iter_mut().map(|column| &mut column[from..to]);
                    sum += errors[channels.of(index, k)].whiten(&series.times, parts);
                    from = to;
                }
                sum
            }
            Self::Force(error, motions) => {
                error.whiten(&motions[index].linearised, columns.iter_mut().map(Vec::as_mut_slice))
            }
        }
    }

    /// Returns the log-likelihood of residuals of records under an error model at the outputs.
    pub fn log_likelihood(&self, pieces: &[Piece], channels: &Channels, residuals: Vec<Vec<f64>>) -> f64 {
        let of = |(index, (piece, residuals)): (usize, (&Piece, Vec<f64>))| {
            let mut columns = [residuals];
            self.whiten(piece, channels, index, &mut columns) + columns[0].iter().map(|r| r * r).sum::<f64>()
        };
        -0.5 * pieces.iter().zip(residuals).enumerate().map(of).sum::<f64>()
    }

    /// Returns the error model with the logarithm of its deviations changed.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        let factor = math::exp(by);
        match self {
            Self::White => Self::White,
            Self::Output(errors) => {
                let scaled = |e: &OutputError| OutputError { deviation: e.deviation * factor, ..*e };
                Self::Output(errors.iter().map(scaled).collect())
            }
            Self::Force(error, motions) => {
                let error = ForceError { deviation: error.deviation * factor, ..error.clone() };
                Self::Force(error, motions.clone())
            }
        }
    }

    /// Takes the responses to the force along which the records are linearised out of the residuals of each record.
    pub fn take_force_out_of<'r>(&self, residuals: impl Iterator<Item = &'r mut Vec<f64>>) {
        let Self::Force(_, motions) = self else { return };
        residuals.zip(motions).for_each(|(residuals, motion)| *residuals = motion.without_force(residuals));
    }

    /// Fits the hyperparameters of a kind to what was observed, from `before` and, where `thoroughly`, from both ends
    /// of the correlation length. `motions` are needed for a force, and residuals are then those without it.
    pub fn fit(
        kind: ErrorModel,
        observed: Observed<'_>,
        motions: Vec<Motion>,
        before: Option<&Self>,
        thoroughly: bool,
    ) -> Option<Fitted> {
        match kind {
            ErrorModel::Force => Self::fit_force(observed, motions, before, thoroughly),
            ErrorModel::SmoothOutput | ErrorModel::RoughOutput => {
                let kernel = if kind == ErrorModel::RoughOutput { Kernel::OrnsteinUhlenbeck } else { Kernel::Matern32 };
                let before = match before {
                    Some(Self::Output(errors)) => Some(errors),
                    _ => None,
                };
                let fitted: Option<Vec<_>> = (0..observed.channels.count)
                    .map(|c| fit_output(kernel, c, observed, before.map(|b| &b[c]), thoroughly))
                    .collect();
                let fitted = fitted?;
                Some(Fitted {
                    count: OutputError::HYPERPARAMETERS * fitted.len(),
                    log_prior: fitted.iter().map(|f| f.1).sum(),
                    log_determinant: fitted.iter().map(|f| f.2).sum(),
                    errors: Self::Output(fitted.into_iter().map(|f| f.0).collect()),
                })
            }
        }
    }

    fn fit_force(
        observed: Observed<'_>,
        motions: Vec<Motion>,
        before: Option<&Self>,
        thoroughly: bool,
    ) -> Option<Fitted> {
        let Observed { channels, residuals, settings, .. } = observed;
        if 2 + channels.count > WIDEST {
            return None;
        }
        // Dual numbers as wide as the common numbers of channels need.
        let score = |x: &[f64]| match x.len() {
            ..=3 => force_score::<3>(x, residuals, &motions, settings.noise_prior),
            4 => force_score::<4>(x, residuals, &motions, settings.noise_prior),
            5..=7 => force_score::<7>(x, residuals, &motions, settings.noise_prior),
            _ => force_score::<WIDEST>(x, residuals, &motions, settings.noise_prior),
        };
        let step = channels.shortest_step();
        let length = channels.length.iter().copied().fold(0.0, f64::max);
        let lengths = [SHORTEST * step, length.max(2.0 * step)].map(math::ln);
        let mut bounds = vec![FORCES.map(math::ln), lengths];
        bounds.extend(std::iter::repeat_n(noise_bounds(rms(residuals)), channels.count));
        let mut starts: Vec<Vec<f64>> = Vec::new();
        if let Some(Self::Force(error, _)) = before {
            let noise = error.noise.iter().map(|&n| math::ln(n));
            starts.push([math::ln(error.deviation), math::ln(error.length)].into_iter().chain(noise).collect());
        }
        if thoroughly || starts.is_empty() {
            for samples in LENGTHS {
                for deviation in [0.02, 0.5] {
                    let noise = std::iter::repeat_n(0.0, channels.count);
                    starts.push([math::ln(deviation), math::ln(samples * step)].into_iter().chain(noise).collect());
                }
            }
        }
        let best = best_of(&starts, &bounds, score)?;
        let error = ForceError {
            deviation: math::exp(best.point[0]),
            length: math::exp(best.point[1]),
            noise: best.point[2..].iter().map(|&x| math::exp(x)).collect(),
        };
        let count = 2 + channels.count;
        let prior = Prior::new(lengths, &best.point[2..], settings);
        let log_determinant = prior.log_determinant(&best.score.information, channels.count);
        Some(Fitted { errors: Self::Force(error, motions), count, log_prior: prior.log, log_determinant })
    }
}

/// Prior of hyperparameters: deviation, correlation length, noises.
struct Prior {
    log: f64,
    /// Precisions of the logarithms of deviation and correlation length.
    precisions: [f64; 2],
}

impl Prior {
    /// The deviation is normal and taken at the centre, the correlation length uniform, each noise normal about that of
    /// the sensor.
    fn new(lengths: [f64; 2], noise: &[f64], settings: &Settings) -> Self {
        let Settings { deviation_prior, noise_prior, .. } = settings;
        let half = 0.5 * math::ln(std::f64::consts::TAU);
        let range = lengths[1] - lengths[0];
        let deviation = -math::ln(*deviation_prior) - half;
        let of_noise: f64 =
            noise.iter().map(|x| -0.5 * x * x / (noise_prior * noise_prior) - math::ln(*noise_prior) - half).sum();
        Self {
            log: deviation - math::ln(range) + of_noise,
            precisions: [1.0 / (deviation_prior * deviation_prior), 12.0 / (range * range)],
        }
    }

    /// Log-determinant of the information with the precision of the prior; the information has that of the noise
    /// already.
    fn log_determinant(&self, information: &DMatrix<f64>, channels: usize) -> f64 {
        debug_assert_eq!(information.nrows(), 2 + channels);
        let mut with = information.clone();
        with[(0, 0)] += self.precisions[0];
        with[(1, 1)] += self.precisions[1];
        super::scoring::log_determinant(&with)
    }
}

/// Adds the prior of the logarithms of noises, normal about 0 with a standard deviation, to a score.
fn with_noise_prior(mut score: Score, x: &[f64], first: usize, deviation: f64) -> Score {
    for k in first..x.len() {
        score.log -= 0.5 * x[k] * x[k] / (deviation * deviation);
        score.gradient[k] -= x[k] / (deviation * deviation);
        score.information[(k, k)] += 1.0 / (deviation * deviation);
    }
    score
}

fn force_score<const N: usize>(x: &[f64], residuals: &[Vec<f64>], motions: &[Motion], noise_prior: f64) -> Score {
    let noise = x[2..].iter().map(|&x| math::exp(x)).collect();
    let error = ForceError { deviation: math::exp(x[0]), length: math::exp(x[1]), noise };
    let count = x.len();
    let mut score = Score { log: 0.0, gradient: DVector::zeros(count), information: DMatrix::zeros(count, count) };
    for (residuals, motion) in residuals.iter().zip(motions) {
        let found = error.likelihood::<N>(&motion.linearised, residuals);
        score.log += found.log();
        score.gradient += found.gradient().rows(0, count);
        score.information += found.information().view((0, 0), (count, count));
    }
    with_noise_prior(score, x, 2, noise_prior)
}

fn noise_bounds(rms: f64) -> [f64; 2] {
    [LEAST_NOISE, (1.5 * rms).max(3.0)].map(math::ln)
}

/// Root mean square of all residuals.
#[allow(clippy::cast_precision_loss)]
fn rms(residuals: &[Vec<f64>]) -> f64 {
    let count: usize = residuals.iter().map(Vec::len).sum();
    let sum: f64 = residuals.iter().flatten().map(|r| r * r).sum();
    (sum / count.max(1) as f64).sqrt()
}

fn best_of(starts: &[Vec<f64>], bounds: &[[f64; 2]], score: impl Fn(&[f64]) -> Score) -> Option<Maximum> {
    let all = starts.iter().filter_map(|start| maximise(start, bounds, &score));
    all.max_by(|a, b| a.score.log.total_cmp(&b.score.log))
}

/// Fits the output error of a channel; returns it with its log-prior and log-determinant.
fn fit_output(
    kernel: Kernel,
    channel: usize,
    observed: Observed<'_>,
    before: Option<&OutputError>,
    thoroughly: bool,
) -> Option<(OutputError, f64, f64)> {
    let Observed { pieces, channels, residuals, settings } = observed;
    let mut series: Vec<(&[f64], &[f64])> = Vec::new();
    for (index, (piece, residuals)) in pieces.iter().zip(residuals).enumerate() {
        let mut from = 0;
        for (k, s) in piece.series.iter().enumerate() {
            let to = from + s.times.len();
            if channels.of(index, k) == channel {
                series.push((&s.times, &residuals[from..to]));
            }
            from = to;
        }
    }
    let error =
        |x: &[f64]| OutputError { kernel, deviation: math::exp(x[0]), length: math::exp(x[1]), noise: math::exp(x[2]) };
    let score = |x: &[f64]| {
        let error = error(x);
        let mut score = Score { log: 0.0, gradient: DVector::zeros(3), information: DMatrix::zeros(3, 3) };
        for (times, residuals) in &series {
            let found = error.likelihood(times, residuals);
            score.log += found.log();
            score.gradient += found.gradient();
            score.information += found.information();
        }
        with_noise_prior(score, x, 2, settings.noise_prior)
    };
    #[allow(clippy::cast_precision_loss)]
    let count = series.iter().map(|(times, _)| times.len()).sum::<usize>().max(1) as f64;
    let rms = (series.iter().flat_map(|(_, r)| r.iter()).map(|r| r * r).sum::<f64>() / count).sqrt();
    let longest = if kernel == Kernel::OrnsteinUhlenbeck { LONGEST_ROUGH } else { 1.0 };
    let step = channels.step[channel];
    let shortest = if kernel == Kernel::OrnsteinUhlenbeck { 1.0 } else { SHORTEST };
    let lengths = [shortest * step, (longest * channels.length[channel]).max(2.0 * step)].map(math::ln);
    let bounds = [[OUTPUTS[0], OUTPUTS[1] * rms.max(1.0)].map(math::ln), lengths, noise_bounds(rms)];
    let mut starts: Vec<Vec<f64>> = Vec::new();
    if let Some(before) = before {
        starts.push([before.deviation, before.length, before.noise].map(math::ln).to_vec());
    }
    if thoroughly || before.is_none() {
        for samples in LENGTHS {
            starts.push(vec![math::ln(rms.max(0.1)), math::ln(samples * step), 0.0]);
        }
    }
    let best = best_of(&starts, &bounds, score)?;
    let prior = Prior::new(lengths, &best.point[2..], settings);
    Some((error(&best.point), prior.log, prior.log_determinant(&best.score.information, 1)))
}
