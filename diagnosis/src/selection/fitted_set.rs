//! A set of effects, fitted to the calibration records.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use mops_math as math;
use rayon::prelude::*;

use crate::candidates::Candidate;
use crate::estimation::{Channels, ErrorModel, Errors, Estimate, Estimation, Observed, log_choices, priors};
use crate::fit::{Added, Fit, Piece, Point, Variant};
use crate::motion::Trajectory;
use crate::records::{Series, Subject};
use crate::settings::Settings;

/// Twice a difference of log-evidence from which it is strong: of sets that differ less, the simplest is named. Also
/// the squared distance of two predictions, in squared noises, from which data distinguish them. Source: R. E. Kass, A.
/// E. Raftery, Bayes factors, Journal of the American Statistical Association 90 (1995) 773, section 3.2.
pub const STRONG: f64 = 6.0;

/// Values to start a fit from: parameters of the study, initial states of each record, and effects with theirs.
#[derive(Clone)]
pub struct Start {
    /// Parameters of the study.
    pub tuners: Vec<f64>,
    /// Initial states of the declared model in each record.
    pub locals: Vec<Vec<f64>>,
    /// Effects.
    pub added: Vec<Added>,
}

impl Start {
    /// Returns the start with one more effect.
    #[must_use]
    pub fn with(&self, newest: &Added) -> Self {
        let mut start = self.clone();
        start.added.push(newest.clone());
        start
    }

    /// Returns the start without an effect.
    #[must_use]
    pub fn without(&self, index: usize) -> Self {
        let mut start = self.clone();
        start.added.remove(index);
        start
    }
}

/// Candidates by index, in ascending order.
pub type Key = Vec<usize>;

/// Model with a set of effects, fitted by least squares and, where it matters, under the error models.
#[derive(Clone)]
pub struct FittedSet<'a> {
    /// Candidates of the set.
    pub key: Key,
    /// Effects in the order of their parameters.
    pub added: Vec<Added>,
    /// Problem of the fit.
    pub fit: Fit<'a>,
    /// Augmented model.
    pub variant: Variant,
    /// Fit by least squares.
    pub least_squares: Estimate,
    /// True if its fit by least squares has converged, or gains next to nothing in further tries from where it stopped.
    pub is_settled: bool,
    /// Fits under the error models; empty until they are needed.
    pub under: Vec<(ErrorModel, Estimate)>,
    /// Whether selection records contradict it, once that was asked.
    pub contradicted: OnceLock<bool>,
}

impl FittedSet<'_> {
    /// Returns the estimation problem, with the nominal rates of the baseline.
    pub fn estimation(&self, nominal: &[f64]) -> Estimation<'_> {
        estimation(self.fit.subject, &self.fit, &self.variant, &self.added, nominal, &self.least_squares.point)
    }

    /// Returns the motion in each record at a point; `None` if a simulation fails.
    pub fn trajectories(&self, point: &Point) -> Option<Vec<Trajectory>> {
        let of = |piece: usize| Trajectory::new(&self.fit, &self.variant.model, piece, point).ok();
        (0..self.fit.pieces.len()).into_par_iter().map(of).collect()
    }

    /// Returns the position of a candidate among the effects of the set.
    pub fn position(&self, index: usize) -> usize {
        self.added.iter().position(|added| added.candidate.index == index).expect("the set holds it")
    }

    /// Returns the fit under an error model.
    pub fn estimate(&self, kind: ErrorModel) -> Option<&Estimate> {
        self.under.iter().find(|(of, _)| *of == kind).map(|(_, estimate)| estimate)
    }

    /// Returns the number of parameters of the effects.
    pub fn parameters(&self) -> usize {
        self.added.iter().map(|added| added.candidate.effect.parameters().len()).sum()
    }

    /// Returns the likeliest error model and the fit under it.
    pub fn likeliest(&self) -> Option<&(ErrorModel, Estimate)> {
        self.under.iter().max_by(|a, b| evidence(&a.1).total_cmp(&evidence(&b.1)))
    }

    /// Returns the logarithm of the mean evidence over the error models; a model without a fit counts as 0.
    pub fn log_evidence(&self) -> f64 {
        let logarithms: Vec<f64> = self.under.iter().map(|(_, estimate)| evidence(estimate)).collect();
        let most = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if most == f64::NEG_INFINITY {
            return most;
        }
        let sum: f64 = logarithms.iter().map(|l| math::exp(l - most)).sum();
        #[allow(clippy::cast_precision_loss)]
        let count = ErrorModel::ALL.len() as f64;
        most + math::ln(sum / count)
    }

    /// Returns by how much correlated errors are likelier than white noise of fitted size, nats: what shows that the
    /// model still lacks something. `None` if the set cannot be simulated or no error model could be fitted.
    pub fn lack_of_fit(&self) -> Option<f64> {
        let (_, likeliest) = self.likeliest()?;
        let white = white_log_likelihood(&self.fit.pieces, &self.fit.all(&self.least_squares.point)?);
        Some(likeliest.log_likelihood - white)
    }

    /// Returns the standard deviation of the white noise of each sensor in noise levels, under the likelier of the
    /// smooth error models: a rough one takes part of it for an error of the model.
    pub fn noises(&self) -> Vec<(String, f64)> {
        let smooth =
            self.under.iter().filter(|(kind, _)| *kind != ErrorModel::RoughOutput).map(|(_, estimate)| estimate);
        let Some(likelier) = smooth.max_by(|a, b| evidence(a).total_cmp(&evidence(b))) else { return Vec::new() };
        let channels = Channels::new(&self.fit.pieces);
        let mut all: BTreeMap<String, f64> = BTreeMap::new();
        for (index, piece) in self.fit.pieces.iter().enumerate() {
            for (k, series) in piece.series.iter().enumerate() {
                all.insert(series.name.clone(), likelier.errors.noise(channels.of(index, k)));
            }
        }
        all.into_iter().collect()
    }

    /// Returns the root mean square error of all records by least squares, in noises.
    pub fn error(&self) -> Option<f64> {
        Some(rms(self.fit.all(&self.least_squares.point)?.iter().flatten()))
    }

    /// Returns the log-likelihood from which another set leaves little of the error above noise of this one.
    pub fn with_little_error(&self) -> f64 {
        let little = self.fit.subject.settings.little;
        self.with_share_of_error(little * little, 1.0)
    }

    /// Returns the log-likelihood in white noise of the declared size with a share of the mean square error above a
    /// level, in squared noises.
    pub fn with_share_of_error(&self, share: f64, level: f64) -> f64 {
        let samples: usize = self.fit.pieces.iter().flat_map(|piece| &piece.series).map(|s| s.times.len()).sum();
        #[allow(clippy::cast_precision_loss)]
        let half = 0.5 * samples as f64;
        let none = -half * math::ln(std::f64::consts::TAU);
        none - half * level + share * (self.least_squares.log_likelihood - none + half * level)
    }

    /// Returns the largest root mean square error of a record by least squares, in noises.
    pub fn largest_error(&self) -> Option<f64> {
        Some(largest(&self.fit.all(&self.least_squares.point)?))
    }

    /// Returns the values of the set at a point, to start another fit from.
    pub fn start_at(&self, point: &Point) -> Start {
        start_at(&self.added, &self.fit, &self.variant, point)
    }
}

/// Returns the root mean square of residuals.
pub fn rms<'r>(residuals: impl Iterator<Item = &'r f64>) -> f64 {
    let (sum, count) = residuals.fold((0.0, 0.0_f64), |(sum, count), r| (sum + r * r, count + 1.0));
    (sum / count.max(1.0)).sqrt()
}

/// Returns the largest root mean square of the residuals of a record.
pub fn largest(residuals: &[Vec<f64>]) -> f64 {
    residuals.iter().map(|r| rms(r.iter())).fold(0.0, f64::max)
}

/// Returns the log-likelihood of the residuals of records under white noise, fitted to each channel.
pub fn white_log_likelihood(pieces: &[Piece], residuals: &[Vec<f64>]) -> f64 {
    let of = |(square, count): (f64, f64)| -0.5 * count * (math::ln(std::f64::consts::TAU * square / count) + 1.0);
    squares(pieces, residuals).into_iter().filter(|sum| sum.1 > 0.0).map(of).sum::<f64>()
}

/// Returns the sum of squared residuals and their number for each channel.
#[allow(clippy::cast_precision_loss)]
pub fn squares(pieces: &[Piece], residuals: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let channels = Channels::new(pieces);
    let mut sums = vec![(0.0, 0.0); channels.count];
    for (index, (piece, residuals)) in pieces.iter().zip(residuals).enumerate() {
        for (k, (_, own)) in Series::with_parts(&piece.series, residuals).enumerate() {
            let sum = &mut sums[channels.of(index, k)];
            *sum = (sum.0 + own.iter().map(|r| r * r).sum::<f64>(), sum.1 + own.len() as f64);
        }
    }
    sums
}

/// Returns by how much residuals of other records are likelier under white noise of their own size than under that of
/// given ones, nats; channels of smaller residuals do not count. Channels without counterpart are compared with the
/// noise of their sensors.
pub fn growth(given: (&[Piece], &[Vec<f64>]), others: (&[Piece], &[Vec<f64>])) -> f64 {
    let mean = |(square, count): &(f64, f64)| if *count > 0.0 { square / count } else { 1.0 };
    let known: Vec<f64> = squares(given.0, given.1).iter().map(mean).collect();
    let of = |(c, sum): (usize, &(f64, f64))| {
        let ratio = mean(sum) / known.get(c).copied().unwrap_or(1.0).max(f64::MIN_POSITIVE);
        if ratio > 1.0 { 0.5 * sum.1 * (ratio - 1.0 - math::ln(ratio)) } else { 0.0 }
    };
    squares(others.0, others.1).iter().enumerate().map(of).sum()
}

/// Returns the log-likelihood of given residuals of records under the likelier error model at the outputs that is
/// fitted to them; `None` if neither can be fitted.
fn correlated_log_likelihood(pieces: &[Piece], residuals: &[Vec<f64>], settings: &Settings) -> Option<f64> {
    let channels = Channels::new(pieces);
    let observed = Observed { pieces, channels: &channels, residuals, settings };
    let log = |kind| {
        let fitted = Errors::fit(kind, observed, Vec::new(), None, true)?;
        Some(fitted.errors.log_likelihood(pieces, &channels, residuals.to_vec()))
    };
    [ErrorModel::SmoothOutput, ErrorModel::RoughOutput].into_iter().filter_map(log).max_by(f64::total_cmp)
}

/// Returns by how much correlated errors at the outputs are likelier than white noise of fitted size for given
/// residuals of records, nats; `None` if neither can be fitted.
pub fn correlation(pieces: &[Piece], residuals: &[Vec<f64>], settings: &Settings) -> Option<f64> {
    Some(correlated_log_likelihood(pieces, residuals, settings)? - white_log_likelihood(pieces, residuals))
}

/// Returns by how much residuals of other records are likelier under an error model of their own than under a given one
/// at the outputs, nats; `None` if none can be fitted, or the records have other channels.
pub fn surprise(errors: &Errors, pieces: &[Piece], residuals: &[Vec<f64>], settings: &Settings) -> Option<f64> {
    let channels = Channels::new(pieces);
    let is_of_all = matches!(errors, Errors::Output(errors) if errors.len() == channels.count);
    let own = correlated_log_likelihood(pieces, residuals, settings).filter(|_| is_of_all)?;
    Some(own - errors.log_likelihood(pieces, &channels, residuals.to_vec()))
}

/// Returns the values of a set of effects at a point of its fit, to start another fit from.
pub fn start_at(added: &[Added], fit: &Fit<'_>, variant: &Variant, point: &Point) -> Start {
    let mut added = added.to_vec();
    for (index, effect) in added.iter_mut().enumerate() {
        effect.take(index, variant, fit, point);
    }
    let declared = |(values, piece): (&Vec<f64>, &Piece)| {
        values[..fit.subject.measurements[piece.measurement].locals.len()].to_vec()
    };
    let locals = point.locals.iter().zip(&fit.pieces).map(declared).collect();
    Start { tuners: point.globals[..fit.subject.globals.len()].to_vec(), locals, added }
}

/// Returns the logarithm of the evidence of an estimate.
pub fn evidence(estimate: &Estimate) -> f64 {
    estimate.log_evidence.unwrap_or(f64::NEG_INFINITY)
}

/// Returns the estimation problem of a fit near a point.
pub fn estimation<'e>(
    subject: &Subject,
    fit: &'e Fit<'e>,
    variant: &'e Variant,
    added: &[Added],
    nominal: &[f64],
    near: &Point,
) -> Estimation<'e> {
    Estimation {
        fit,
        model: &variant.model,
        channels: Channels::new(&fit.pieces),
        nominal: nominal.to_vec(),
        priors: priors(subject, fit, variant, added, near),
        log_choices: log_choices(added),
    }
}

/// Returns the name of a candidate: `effect@place`, then the companion and the only record, if any.
pub fn name(candidate: &Candidate, subject: &Subject) -> String {
    let mut name = format!("{}@{}", candidate.effect.name(), candidate.place());
    if let Some(companion) = &candidate.companion {
        name += &format!(" with {companion}");
    }
    if let Some(only) = candidate.only {
        name += &format!(" in {}", subject.measurements[only].name);
    }
    name
}
