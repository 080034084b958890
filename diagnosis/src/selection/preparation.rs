//! What a search starts from: the declared model, and the candidates that the records can show.

use std::sync::Arc;

use mops_core::{Effect, Role, StudyError};
use mops_language::suggestion;

use super::baseline::baseline;
use super::fitted_set::{FittedSet, Start, name};
use super::refit::Refit;
use super::screening::Screening;
use super::sets::FittedSets;
use super::widened::Widened;
use crate::candidates::{Candidate, candidates, numbered};
use crate::estimation::{Errors, nominal_rates};
use crate::fit::{Added, Meter, pieces, problem};
use crate::motion::is_covered;
use crate::records::Subject;

/// Adds effects that the study gives, `effect@place` each, to the fitted declared model, and fits it under the error
/// models: the first of the sets, whose effects all others have.
///
/// # Errors
/// An effect that is no candidate or that cannot be fitted, or a model that cannot be fitted under any error model.
pub fn with_given<'r, 'a>(
    refit: &'r Refit<'a>,
    declared: FittedSet<'a>,
    names: &[String],
    most: usize,
    level: f64,
) -> Result<FittedSets<'r, 'a>, StudyError> {
    let mut set = declared;
    for wanted in names {
        let mistake = |fact: String| StudyError::new("with", fact).within("diagnosis");
        let is = |candidate: &Candidate| name(candidate, refit.subject) == *wanted;
        let index = refit.candidates.iter().position(is).ok_or_else(|| {
            let known =
                refit.candidates.iter().map(|candidate| name(candidate, refit.subject)).collect::<Vec<String>>();
            mistake(format!("no effect `{wanted}` fits the model and the records"))
                .with_help(suggestion(wanted, known.iter().map(String::as_str)))
        })?;
        let white = [Errors::White];
        let screened =
            Screening::new(&set, &white).and_then(|screening| screening.screen(&refit.candidates, &[index]).pop());
        let guesses = screened.map_or_else(Vec::new, |screened| screened.guesses);
        let start = set.start_at(&set.least_squares.point);
        let again = guesses.iter().flat_map(Added::restarts);
        let starts: Vec<Start> = guesses.iter().cloned().chain(again).map(|guess| start.with(&guess)).collect();
        set = refit.least_squares(&Vec::new(), &starts).ok_or_else(|| {
            mistake(format!("`{wanted}` cannot be fitted"))
                .with_help("the parameters of the model can mimic all that it does")
        })?;
    }
    let sets = FittedSets::new(refit, set, most, level);
    if sets.declared().under.is_empty() { Err(not_fitted(refit.simulations)) } else { Ok(sets) }
}

/// Returns why the declared model was not fitted.
fn not_fitted(simulations: &Meter<'_>) -> StudyError {
    if simulations.is_over() {
        return StudyError::here("the diagnosis was interrupted before the declared model was fitted");
    }
    StudyError::new("tuners", "the declared model cannot be simulated from anywhere near the start values")
        .with_help("`mops simulate` shows what happens there; start nearer to what is plausible")
}

/// Fits the declared model by least squares, and returns it with what fits sets of effects to the same records.
///
/// # Errors
/// The declared model cannot be simulated, or the watch stops it.
pub fn prepare<'a>(
    subject: &'a Subject,
    effects: &[Arc<dyn Effect>],
    simulations: &'a Meter<'a>,
) -> Result<(Refit<'a>, FittedSet<'a>), StudyError> {
    prepare_from(subject, None, effects, simulations)
}

/// Fits the declared model as [`prepare`] does, from a start that is known.
///
/// # Errors
/// The declared model cannot be simulated, or the watch stops it.
pub fn prepare_from<'a>(
    subject: &'a Subject,
    start: Option<Start>,
    effects: &[Arc<dyn Effect>],
    simulations: &'a Meter<'a>,
) -> Result<(Refit<'a>, FittedSet<'a>), StudyError> {
    fitted(subject, start, effects, simulations).ok_or_else(|| not_fitted(simulations))
}

/// Returns a subject with the noise that the study does not give estimated without the motion of the declared model,
/// and the fit that this took, if any.
pub fn without_motion(subject: Subject, simulations: &Meter<'_>) -> (Subject, Option<Start>) {
    if !subject.has_estimated_noise() {
        return (subject, None);
    }
    simulations.stage("noise of the sensors", 0.01);
    let Some(start) = baseline(&subject, simulations) else { return (subject, None) };
    let residuals = {
        let pieces = pieces::pieces(&subject, |role| role == Role::Calibration);
        let measured: Vec<usize> = pieces.iter().map(|piece| piece.measurement).collect();
        let Start { tuners, locals, .. } = &start;
        let (fit, point, _) = problem(&subject, &[], pieces, tuners, locals.clone(), &[], simulations);
        fit.all(&point).map(|residuals| measured.into_iter().zip(residuals).collect::<Vec<_>>())
    };
    match residuals {
        Some(residuals) => (subject.with_motion_removed(&residuals), Some(start)),
        None => (subject, Some(start)),
    }
}

fn fitted<'a>(
    subject: &'a Subject,
    start: Option<Start>,
    effects: &[Arc<dyn Effect>],
    simulations: &'a Meter<'a>,
) -> Option<(Refit<'a>, FittedSet<'a>)> {
    simulations.stage("fit of the declared model", 0.02);
    let start = start.map_or_else(|| baseline(subject, simulations), Some)?;
    subject.take_pace(&start.tuners);
    let candidates = candidates(subject, effects);
    let mut refit = Refit { subject, candidates, nominal: Vec::new(), widened: None, simulations };
    let declared = refit.least_squares(&Vec::new(), &[start])?;
    refit.widened = Widened::of(&declared);
    let trajectories = declared.trajectories(&declared.least_squares.point)?;
    refit.nominal = nominal_rates(&declared.variant, &trajectories);
    let (model, pieces, coverage) = (&declared.variant.model, &declared.fit.pieces, subject.settings.coverage);
    refit.candidates.retain(|candidate| is_covered(candidate, model, pieces, &trajectories, coverage));
    refit.candidates = numbered(refit.candidates);
    Some((refit, declared))
}
