//! What a search starts from: the declared model, and the candidates that the records can show.

use std::sync::Arc;

use mops_core::{Effect, StudyError};
use mops_language::suggestion;

use super::baseline::baseline;
use super::fitted_set::{FittedSet, Start, name};
use super::refit::Refit;
use super::screening::Screening;
use super::sets::FittedSets;
use crate::candidates::{Candidate, candidates, numbered};
use crate::estimation::{Errors, nominal_rates};
use crate::fit::{Added, Meter};
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
    fitted(subject, effects, simulations).ok_or_else(|| not_fitted(simulations))
}

fn fitted<'a>(
    subject: &'a Subject,
    effects: &[Arc<dyn Effect>],
    simulations: &'a Meter<'a>,
) -> Option<(Refit<'a>, FittedSet<'a>)> {
    simulations.stage("fit of the declared model", 0.02);
    let start = baseline(subject, simulations)?;
    subject.take_pace(&start.tuners);
    let mut refit = Refit { subject, candidates: candidates(subject, effects), nominal: Vec::new(), simulations };
    let declared = refit.least_squares(&Vec::new(), &[start])?;
    let trajectories = declared.trajectories(&declared.least_squares.point)?;
    refit.nominal = nominal_rates(&declared.variant, &trajectories);
    let (model, pieces, coverage) = (&declared.variant.model, &declared.fit.pieces, subject.settings.coverage);
    refit.candidates.retain(|candidate| is_covered(candidate, model, pieces, &trajectories, coverage));
    refit.candidates = numbered(refit.candidates);
    Some((refit, declared))
}
