//! What a search starts from: the declared model, and the candidates that the records can tell.

use std::sync::Arc;

use mops_core::{Effect, StudyError};
use mops_language::suggestion;

use super::baseline::baseline;
use super::coverage::is_covered;
use super::fitted_set::{FittedSet, Start, name};
use super::refit::Refit;
use super::screening::Scene;
use crate::candidate::Candidate;
use crate::estimation::{Errors, nominal_rates};
use crate::meter::Meter;
use crate::subject::Subject;
use crate::variant::Added;

/// Adds effects that the study gives, `effect@place` each, to the fitted declared model, and fits it again. They are in all sets.
///
/// # Errors
/// An effect that is no candidate, or that cannot be fitted.
pub fn with_given<'a>(
    refit: &Refit<'a>,
    declared: FittedSet<'a>,
    names: &[String],
) -> Result<FittedSet<'a>, StudyError> {
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
        let screened = Scene::new(&set, &white).and_then(|scene| scene.screen(&refit.candidates, &[index]).pop());
        let guesses = screened.map_or_else(Vec::new, |screened| screened.guesses);
        let start = set.start_at(&set.least_squares.point);
        let again = guesses.iter().flat_map(Added::restarts);
        let starts: Vec<Start> = guesses.iter().cloned().chain(again).map(|guess| start.with(&guess)).collect();
        set = refit.least_squares(&Vec::new(), &starts).ok_or_else(|| {
            mistake(format!("`{wanted}` cannot be fitted"))
                .with_help("the parameters of the model can mimic all that it does")
        })?;
    }
    Ok(set)
}

/// Fits the declared model by least squares, and returns it with what fits sets of effects to the same records; `None` if it
/// cannot be simulated.
pub fn prepare<'a>(
    subject: &'a Subject,
    effects: &[Arc<dyn Effect>],
    simulations: &'a Meter<'a>,
) -> Option<(Refit<'a>, FittedSet<'a>)> {
    simulations.stage("fit of the declared model", 0.02);
    let start = baseline(subject, simulations)?;
    subject.take_pace(&start.tuners);
    let mut refit = Refit { subject, candidates: subject.candidates(effects), nominal: Vec::new(), simulations };
    let declared = refit.least_squares(&Vec::new(), &[start])?;
    let trajectories = declared.trajectories(&declared.least_squares.point)?;
    refit.nominal = nominal_rates(&declared.variant, &trajectories);
    refit
        .candidates
        .retain(|candidate| is_covered(candidate, &declared.variant.model, &declared.fit.pieces, &trajectories));
    Some((refit, declared))
}
