//! A set of effects, fitted to the calibration records.

use mops_core::math;

use crate::candidate::Candidate;
use crate::estimation::{Channels, ErrorModel, Estimate, Estimation, log_choices, priors};
use crate::fit::{Fit, Point};
use crate::subject::Subject;
use crate::variant::{Added, Variant};

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
    /// Fits under the error models; empty until they are needed.
    pub under: Vec<(ErrorModel, Estimate)>,
}

impl FittedSet<'_> {
    /// Returns the estimation problem, with the nominal rates of the baseline.
    pub fn estimation(&self, nominal: &[f64]) -> Estimation<'_> {
        estimation(self.fit.subject, &self.fit, &self.variant, &self.added, nominal)
    }

    /// Returns the fit under an error model.
    pub fn estimate(&self, kind: ErrorModel) -> Option<&Estimate> {
        self.under.iter().find(|(of, _)| *of == kind).map(|(_, estimate)| estimate)
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

    /// Returns the values of the set at a point, to start another fit from.
    pub fn start_at(&self, point: &Point) -> Start {
        let mut added = self.added.clone();
        for (index, effect) in added.iter_mut().enumerate() {
            effect.take(index, &self.variant, &self.fit, point);
        }
        let declared = |(values, piece): (&Vec<f64>, &crate::fit::Piece)| {
            values[..self.fit.subject.measurements[piece.measurement].locals.len()].to_vec()
        };
        let locals = point.locals.iter().zip(&self.fit.pieces).map(declared).collect();
        Start { tuners: point.globals[..self.fit.subject.globals.len()].to_vec(), locals, added }
    }
}

/// Returns the logarithm of the evidence of an estimate.
pub fn evidence(estimate: &Estimate) -> f64 {
    estimate.log_evidence.unwrap_or(f64::NEG_INFINITY)
}

/// Returns the estimation problem of a fit.
pub fn estimation<'e>(
    subject: &Subject,
    fit: &'e Fit<'e>,
    variant: &'e Variant,
    added: &[Added],
    nominal: &[f64],
) -> Estimation<'e> {
    Estimation {
        fit,
        model: &variant.model,
        channels: Channels::new(&fit.pieces),
        nominal: nominal.to_vec(),
        priors: priors(subject, fit, variant, added),
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
