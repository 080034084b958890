//! Sets of effects for people: given ones compared, or those of a search.

use std::sync::Arc;

use mops_core::{Effect, Role, Study, StudyError};
use mops_outcome::diagnosis::Dependence;

use super::fitted_set::{FittedSet, Key, name};
use super::forecast::{Forecasts, free_run};
use super::preparation::prepare;
use super::search::Search;
use super::verdict::{Verdict, decide};
use crate::base;
use crate::estimation::{ErrorModel, Errors, Estimate};
use crate::fit::Sets;
use crate::meter::Meter;
use crate::subject::{Subject, task_of};

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
    /// Logarithm of the posterior probability, relative to the declared model.
    pub log_odds: f64,
    /// True if the set forecasts records of role selection better than the declared model and every set with one effect less;
    /// `None` if that was not tested.
    pub forecasts: Option<bool>,
    /// True if an effect of the set does nothing under every error model.
    pub is_inert: bool,
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
    pub curves: Vec<Dependence>,
    /// True if the fit converged.
    pub converged: bool,
}

/// Fits the declared model and sets of effects, `effect@place` each, to the calibration records of a study. A set is fitted by
/// least squares from each earlier set with one effect less.
///
/// # Errors
/// The study is no diagnosis, a set has no earlier set with one effect less, or a model cannot be simulated.
pub fn compare(study: &Study, effects: &[Arc<dyn Effect>], sets: &[Vec<String>]) -> Result<Selection, StudyError> {
    with_search(study, effects, |search| {
        for set in sets {
            let of = |wanted: &String| {
                let is = |k: &usize| *wanted == name(&search.refit.candidates[*k], search.refit.subject);
                (0..search.refit.candidates.len()).find(is)
            };
            let key: Option<Key> = set.iter().map(of).collect();
            let fitted = key.is_some_and(|mut key| {
                key.sort_unstable();
                search.fit(&key)
            });
            if !fitted {
                return Err(StudyError::here(format!("cannot fit `{}`", set.join(" + ")))
                    .with_help("check each name (`effect@place`); list every set after a set with one effect less"));
            }
        }
        Ok(())
    })
}

/// Searches the sets of effects that explain the calibration records of a study, and returns those that were fitted under all error
/// models, the most probable first.
///
/// # Errors
/// The study is no diagnosis, or the declared model cannot be simulated.
pub fn select(study: &Study, effects: &[Arc<dyn Effect>]) -> Result<Selection, StudyError> {
    let task = task_of(study);
    let tried = |effect: &&Arc<dyn Effect>| task.tries(effect.name());
    let effects: Vec<Arc<dyn Effect>> = effects.iter().filter(tried).cloned().collect();
    with_search(study, &effects, |search| {
        search.begin();
        search.run();
        Ok(())
    })
}

/// Sets of effects, and what follows from them.
#[derive(Debug, Clone)]
pub struct Selection {
    /// Sets that were fitted under all error models.
    pub sets: Vec<SetOfEffects>,
    /// Verdict.
    pub verdict: Verdict,
    /// Names of the effects of the verdict.
    pub found: Vec<String>,
    /// Number of simulations.
    pub simulations: usize,
}

/// Sets that are shown, and how many of the first with errors and curves.
const SHOWN: usize = 12;
const IN_FULL: usize = 2;

fn with_search(
    study: &Study,
    effects: &[Arc<dyn Effect>],
    fit: impl FnOnce(&mut Search<'_, '_>) -> Result<(), StudyError>,
) -> Result<Selection, StudyError> {
    let subject = Subject::new(study)?;
    let simulations = Meter::new(&());
    let failed = || StudyError::here("the model cannot be simulated near its initial guesses");
    let (refit, declared) = prepare(&subject, effects, &simulations).ok_or_else(failed)?;
    let task = &task_of(study);
    let mut search = Search::new(&refit, declared, task.max_effects, task.level);
    fit(&mut search)?;
    let mut forecasts = Forecasts::new(subject.measurements.iter().any(|m| m.role == Role::Selection));
    let verdict = decide(&mut search, &mut forecasts);
    let keys: Vec<Key> = search.sets.iter().map(|set| set.key.clone()).take(SHOWN).collect();
    let declared = search.log_posterior(search.get(&Vec::new()).expect("it was fitted first"));
    // All is computed of the declared model and of the first sets.
    let shown = keys.iter().enumerate().filter_map(|(rank, key)| {
        let set = search.get(key)?;
        Some(SetOfEffects {
            log_odds: search.log_posterior(set) - declared,
            forecasts: forecasts.passed(key),
            is_inert: search.is_inert(set),
            ..shown(&subject, set, &refit.nominal, rank < IN_FULL || key.is_empty() || *key == verdict.set)
        })
    });
    Ok(Selection {
        sets: shown.collect(),
        found: verdict.set.iter().map(|&k| name(&refit.candidates[k], &subject)).collect(),
        verdict,
        simulations: simulations.count(),
    })
}

fn shown(subject: &Subject, set: &FittedSet<'_>, nominal: &[f64], in_full: bool) -> SetOfEffects {
    let estimation = set.estimation(nominal);
    let name_of = |sets: Sets| match sets {
        Sets::Tuner(k) => subject.study.tuners()[subject.globals[k]].name.clone(),
        Sets::Parameter(k) => set.fit.model.interface().parameters[k].variable.name.clone(),
    };
    let fit = |(kind, estimate): (Option<ErrorModel>, &Estimate)| SetFit {
        kind,
        log_likelihood: estimate.log_likelihood,
        log_evidence: estimate.log_evidence,
        values: estimate.point.globals.clone(),
        deviations: estimate.deviations.clone(),
        at_bound: set
            .fit
            .globals
            .iter()
            .zip(&estimate.point.globals)
            .map(|(g, v)| !g.is_pinned() && g.bounds.contains(v))
            .collect(),
        errors: estimate.errors.clone(),
        free_run: [Role::Calibration, Role::Selection, Role::Validation].map(|role| {
            let pieces = base::pieces(subject, |r| in_full && r == role);
            free_run(set, &estimate.point, pieces).map(f64::sqrt)
        }),
        curves: kind.filter(|_| in_full).and_then(|_| estimation.curves(estimate)).unwrap_or_default(),
        converged: estimate.converged,
    };
    let least_squares = (None, &set.least_squares);
    let under = set.under.iter().map(|(kind, estimate)| (Some(*kind), estimate));
    SetOfEffects {
        effects: set.added.iter().map(|added| name(&added.candidate, subject)).collect(),
        parameters: set.fit.globals.iter().map(|global| name_of(global.sets)).collect(),
        fits: std::iter::once(least_squares).chain(under).map(fit).collect(),
        log_evidence: set.log_evidence(),
        log_odds: 0.0,
        forecasts: None,
        is_inert: false,
    }
}
