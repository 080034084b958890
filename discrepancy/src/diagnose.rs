//! The whole way from a study to a diagnosis.

use std::sync::Arc;

use mops_core::{Effect, Role, Study, StudyError, Watch};
use mops_outcome::diagnosis::Diagnosis;

use crate::meter::Meter;
use crate::report::Findings;
use crate::selection::{Forecasts, Search, align, decide, prepare, with_given};
use crate::subject::{Subject, task_of};

/// Options of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Largest number of effects that are added.
    pub max_effects: usize,
    /// Significance level of the test for a lack of fit.
    pub level: f64,
}

/// Finds what the model of a calibration study lacks: fits the declared model, searches the sets of effects that explain the
/// calibration records, and decides by evidence and forecast which of them are claimed. If the watch stops the search, the
/// diagnosis rests on the sets fitted so far.
///
/// # Errors
/// A study that cannot be diagnosed, a declared model that cannot be simulated, or a stop before the declared model was fitted.
pub fn diagnose(
    study: &Study,
    effects: &[Arc<dyn Effect>],
    options: &Options,
    watch: &dyn Watch,
) -> Result<Diagnosis, StudyError> {
    let subject = Subject::new(study)?;
    let simulations = Meter::new(watch);
    let lost = || {
        if simulations.is_over() {
            return StudyError::here("the diagnosis was interrupted before the declared model was fitted");
        }
        StudyError::new("tuners", "the declared model cannot be simulated from anywhere near the start values")
            .with_help("`mops simulate` shows what happens there; start nearer to what is plausible")
    };
    let (refit, declared) = prepare(&subject, effects, &simulations).ok_or_else(lost)?;
    let nominal = declared.clone();
    let has_selection = subject.measurements.iter().any(|m| m.role == Role::Selection);
    let mut forecasts = Forecasts::new(has_selection);
    let begun = |refit, declared| {
        let declared = with_given(refit, declared, &task_of(study).with)?;
        let mut search = Search::new(refit, declared, options.max_effects, options.level);
        if search.sets[0].under.is_empty() {
            return Err(lost());
        }
        search.begin();
        Ok(search)
    };
    let mut search = begun(&refit, declared)?;
    // With inputs that act at other times it begins anew.
    let aligned = align(&search, forecasts.kinds());
    let (aligned, alignment) = aligned.map_or((None, Vec::new()), |(subject, inputs)| (Some(subject), inputs));
    let prepared = aligned.as_ref().and_then(|subject| prepare(subject, effects, &simulations));
    let (refit, declared) = prepared.unzip();
    let alignment = if refit.is_some() { alignment } else { Vec::new() };
    if let Some((refit, declared)) = refit.as_ref().zip(declared) {
        search = begun(refit, declared)?;
    }
    search.run();
    let is_stopped = simulations.conclude();
    simulations.stage("forecasts", 0.85);
    let verdict = decide(&mut search, &mut forecasts);
    simulations.stage("report", 0.95);
    let findings = Findings {
        nominal: &nominal,
        alignment: &alignment,
        search: &search,
        forecasts: &forecasts,
        verdict: &verdict,
        is_stopped,
    };
    Ok(findings.diagnosis())
}
