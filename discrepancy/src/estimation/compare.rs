//! Given sets of effects under the three error models: evidence, parameters, and errors on other records.

use std::sync::{Arc, OnceLock};

use mops_core::{Effect, Role, Study, StudyError, math};

use super::curve::FreeCurve;
use super::errors::{Channels, ErrorModel, Errors};
use super::estimate::{Estimate, Estimation};
use super::priors::{nominal_forces, priors};
use crate::base;
use crate::candidate::Candidate;
use crate::fit::{Fit, Fitted, Piece, Point, Sets};
use crate::meter::Meter;
use crate::screen::{Scene, screen};
use crate::subject::Subject;
use crate::variant::{Added, Variant, problem};

/// Set of effects, fitted to the calibration records.
#[derive(Debug, Clone)]
pub struct SetOfEffects {
    /// Effects, `effect@place` each; none for the declared model.
    pub effects: Vec<String>,
    /// Names of the shared parameters.
    pub parameters: Vec<String>,
    /// Fits that succeeded: least squares, then the error models.
    pub fits: Vec<SetFit>,
    /// Logarithm of the mean evidence over the error models.
    pub log_evidence: f64,
}

/// Fit of a set of effects by least squares or under an error model.
#[derive(Debug, Clone)]
pub struct SetFit {
    /// Error model; `None` for least squares.
    pub kind: Option<ErrorModel>,
    /// Log-likelihood.
    pub log_likelihood: f64,
    /// Logarithm of the evidence under the error model.
    pub log_evidence: Option<f64>,
    /// Values of the shared parameters.
    pub values: Vec<f64>,
    /// Standard errors of the shared parameters; 0 for least squares and fixed parameters.
    pub deviations: Vec<f64>,
    /// Whether each shared parameter is at a bound, where its standard error is not valid.
    pub at_bound: Vec<bool>,
    /// Error model with its hyperparameters.
    pub errors: Errors,
    /// Root mean square errors in noises of calibration, selection and validation records, in free run with free initial states.
    pub free_run: [Option<f64>; 3],
    /// Free curves on top of the fit, the one with the largest gain first; none for least squares.
    pub curves: Vec<FreeCurve>,
    /// True if the fit converged.
    pub converged: bool,
}

/// Further initial guesses: multiples of the typical size of an effect.
const MULTIPLES: [f64; 3] = [0.1, 1.0, 10.0];

/// Largest number of combinations of shapes at each multiple.
const COMBINATIONS: usize = 16;

/// Model with a set of effects, fitted by least squares.
struct Member<'a> {
    effects: Vec<String>,
    added: Vec<Added>,
    fit: Fit<'a>,
    variant: Variant,
    least_squares: Estimate,
}

/// Fits the declared model and sets of effects, `effect@place` each, to the calibration records of a study. A set is fitted by
/// least squares from each earlier set with one effect less.
///
/// # Errors
/// The study is no diagnosis, a set has no earlier set with one effect less, or a model cannot be simulated.
pub fn compare(
    study: &Study,
    effects: &[Arc<dyn Effect>],
    sets: &[Vec<String>],
) -> Result<Vec<SetOfEffects>, StudyError> {
    let subject = Subject::new(study)?;
    let simulations = Meter::new(&());
    let failed = || StudyError::here("the model cannot be simulated near its initial guesses");
    let declared = base::fit(&subject, study.seed(), &simulations).ok_or_else(failed)?;
    subject.take_pace(&declared.point.globals);
    let (tuners, locals) = (&declared.point.globals, declared.point.locals.clone());
    let start = problem(&subject, &[], calibration(&subject), tuners, locals, &[], &simulations);
    let declared = member(&subject, Vec::new(), Vec::new(), start).ok_or_else(failed)?;
    let candidates = subject.candidates(effects);
    let mut members = vec![declared];
    for set in sets {
        let next = members.iter().filter_map(|smaller| larger(&subject, smaller, set, &candidates, &simulations));
        let best = next.max_by(|a, b| a.least_squares.log_likelihood.total_cmp(&b.least_squares.log_likelihood));
        members.push(best.ok_or_else(|| {
            StudyError::here(format!("cannot fit `{}`", set.join(" + ")))
                .with_help("check each name (`effect@place`); list every set after a set with one effect less")
        })?);
    }
    Ok(members.iter().map(|member| compared(&subject, member)).collect())
}

fn calibration(subject: &Subject) -> Vec<Piece> {
    base::pieces(subject, |role| role == Role::Calibration)
}

fn member<'a>(
    subject: &Subject,
    effects: Vec<String>,
    added: Vec<Added>,
    (fit, start, variant): (Fit<'a>, Point, Variant),
) -> Option<Member<'a>> {
    let least_squares = estimation(subject, &fit, &variant, &added, Vec::new()).least_squares(start)?;
    Some(Member { effects, added, fit, variant, least_squares })
}

fn estimation<'e>(
    subject: &Subject,
    fit: &'e Fit<'e>,
    variant: &'e Variant,
    added: &[Added],
    nominal: Vec<f64>,
) -> Estimation<'e> {
    let (model, channels) = (&variant.model, Channels::new(&fit.pieces));
    Estimation { fit, model, channels, nominal, priors: priors(subject, fit, variant, added) }
}

/// Fits a set from a set with one effect less; `None` if that is another one, or all fits fail.
fn larger<'a>(
    subject: &'a Subject,
    smaller: &Member<'_>,
    set: &[String],
    candidates: &[Candidate],
    simulations: &'a Meter<'a>,
) -> Option<Member<'a>> {
    let missing: Vec<&String> = set.iter().filter(|name| !smaller.effects.contains(name)).collect();
    let [missing] = missing[..] else { return None };
    if smaller.effects.len() + 1 != set.len() {
        return None;
    }
    let point = &smaller.least_squares.point;
    let pieces = calibration(subject);
    let declared = |(values, piece): (&Vec<f64>, &Piece)| values[..piece.locals.len()].to_vec();
    let locals: Vec<Vec<f64>> = point.locals.iter().zip(&pieces).map(declared).collect();
    let fits = starts(smaller, candidates, missing)?.into_iter().filter_map(|newest| {
        let mut added = fitted(smaller, point);
        added.push(newest);
        let effects = smaller.effects.iter().chain([missing]).cloned().collect();
        let tuners = &point.globals[..subject.globals.len()];
        let start = problem(subject, &added, pieces.clone(), tuners, locals.clone(), &[], simulations);
        member(subject, effects, added, start)
    });
    fits.max_by(|a, b| a.least_squares.log_likelihood.total_cmp(&b.least_squares.log_likelihood))
}

/// Returns the effects of a model with their parameters at a point.
fn fitted(member: &Member<'_>, point: &Point) -> Vec<Added> {
    let mut added = member.added.clone();
    for (index, effect) in added.iter_mut().enumerate() {
        effect.take(index, &member.variant, &member.fit, point);
    }
    added
}

fn scene(member: &Member<'_>) -> Option<Scene> {
    let point = member.least_squares.point.clone();
    let residuals = member.fit.all(&point)?;
    let count = residuals.iter().map(Vec::len).sum();
    let chi2 = residuals.iter().flatten().map(|r| r * r).sum();
    let fitted = Fitted { point, chi2, count, residuals, normal: OnceLock::new() };
    Scene::new(&member.fit, &member.variant.model, &fitted)
}

/// Returns the candidates of a name with parameters to start from: those that explain most of the residuals, and others.
fn starts(smaller: &Member<'_>, candidates: &[Candidate], name: &str) -> Option<Vec<Added>> {
    let is = |c: &&Candidate| name == format!("{}@{}", c.effect.name(), c.place());
    let wanted: Vec<_> = candidates.iter().filter(is).cloned().collect();
    let screening = screen(&wanted, &smaller.fit, &smaller.variant.model, &scene(smaller)?, &[]);
    let mut all: Vec<Added> = Vec::new();
    for screened in &screening.screened {
        let added = &screened.added;
        all.push(added.clone());
        all.extend(screened.others.iter().cloned());
        all.extend(added.restarts());
        let bounds = added.candidate.effect.parameters()[0].bounds;
        for times in MULTIPLES {
            let shapes = added.sizes.combinations(added.candidate.effect.as_ref());
            all.extend(shapes.into_iter().take(COMBINATIONS).map(|mut strengths| {
                strengths[0] = (strengths[0] * times).clamp(bounds[0], bounds[1]);
                Added { strengths, ..added.clone() }
            }));
        }
    }
    Some(all)
}

/// Fits a model under the error models: from the optimum of least squares, then each from the optima of the others.
fn under_error_models(estimation: &Estimation<'_>, member: &Member<'_>) -> Vec<(ErrorModel, Estimate)> {
    let from = |kind: ErrorModel, start: &Estimate| Some((kind, estimation.under(kind, start.point.clone())?));
    let first: Vec<(ErrorModel, Estimate)> =
        ErrorModel::ALL.into_iter().filter_map(|kind| from(kind, &member.least_squares)).collect();
    let best = |kind: ErrorModel| {
        let own = first.iter().filter(|(of, _)| *of == kind).cloned();
        let others = first.iter().filter(|(of, _)| *of != kind).filter_map(|(_, other)| from(kind, other));
        own.chain(others).max_by(|a, b| evidence(&a.1).total_cmp(&evidence(&b.1)))
    };
    ErrorModel::ALL.into_iter().filter_map(best).collect()
}

fn evidence(estimate: &Estimate) -> f64 {
    estimate.log_evidence.unwrap_or(f64::NEG_INFINITY)
}

fn compared(subject: &Subject, member: &Member<'_>) -> SetOfEffects {
    let nominal = scene(member).map(|scene| nominal_forces(&member.fit, &member.variant, &scene));
    let is_linearised = nominal.is_some();
    let estimation = estimation(subject, &member.fit, &member.variant, &member.added, nominal.unwrap_or_default());
    let estimates = if is_linearised { under_error_models(&estimation, member) } else { Vec::new() };
    let curves = |kind: Option<ErrorModel>, estimate: &Estimate| kind.and_then(|_| estimation.curves(estimate));
    let name = |sets: Sets| match sets {
        Sets::Tuner(k) => subject.study.tuners()[subject.globals[k]].name.clone(),
        Sets::Parameter(k) => member.fit.model.interface().parameters[k].variable.name.clone(),
    };
    let fit = |(kind, estimate): (Option<ErrorModel>, &Estimate)| SetFit {
        kind,
        log_likelihood: estimate.log_likelihood,
        log_evidence: estimate.log_evidence,
        values: estimate.point.globals.clone(),
        deviations: estimate.deviations.clone(),
        at_bound: member
            .fit
            .globals
            .iter()
            .zip(&estimate.point.globals)
            .map(|(g, v)| !g.is_pinned() && g.bounds.contains(v))
            .collect(),
        errors: estimate.errors.clone(),
        free_run: [Role::Calibration, Role::Selection, Role::Validation]
            .map(|role| free_run(subject, member, &estimate.point, role)),
        curves: curves(kind, estimate).unwrap_or_default(),
        converged: estimate.converged,
    };
    let least_squares = (None, &member.least_squares);
    let under = estimates.iter().map(|(kind, estimate)| (Some(*kind), estimate));
    SetOfEffects {
        effects: member.effects.clone(),
        parameters: member.fit.globals.iter().map(|global| name(global.sets)).collect(),
        fits: std::iter::once(least_squares).chain(under).map(fit).collect(),
        log_evidence: log_mean(&estimates.iter().map(|(_, estimate)| evidence(estimate)).collect::<Vec<_>>()),
    }
}

/// Returns the root mean square error in noises over the records of a role, with the parameters of a point and free initial
/// states; `None` if there are no such records, or a simulation fails.
fn free_run(subject: &Subject, member: &Member<'_>, point: &Point, role: Role) -> Option<f64> {
    let pieces = base::pieces(subject, |r| r == role);
    if pieces.is_empty() {
        return None;
    }
    let added = fitted(member, point);
    let simulations = Meter::new(&());
    let locals = base::first_locals(&pieces);
    let tuners = &point.globals[..subject.globals.len()];
    let (mut fit, mut start, variant) = problem(subject, &added, pieces, tuners, locals, &[], &simulations);
    for (global, value) in fit.globals.iter_mut().zip(&mut start.globals) {
        global.bounds = [*value; 2];
    }
    let found = estimation(subject, &fit, &variant, &added, Vec::new()).least_squares(start)?;
    let residuals = fit.all(&found.point)?;
    #[allow(clippy::cast_precision_loss)]
    let count = residuals.iter().map(Vec::len).sum::<usize>() as f64;
    Some((residuals.iter().flatten().map(|r| r * r).sum::<f64>() / count).sqrt())
}

/// Returns the logarithm of the mean of exponentials over all error models; a model without a fit counts as 0.
fn log_mean(logarithms: &[f64]) -> f64 {
    let most = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    let sum: f64 = logarithms.iter().map(|l| math::exp(l - most)).sum();
    #[allow(clippy::cast_precision_loss)]
    let count = ErrorModel::ALL.len() as f64;
    most + math::ln(sum / count)
}
