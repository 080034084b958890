//! The whole way from a study to a diagnosis: the steps of `docs/explanation/diagnosis.md`, in its order.

use std::sync::Arc;

use mops_core::{Effect, Study, StudyError, Watch, task::DiagnosisTask};
use mops_outcome::diagnosis::Diagnosis;

use crate::fit::Meter;
use crate::records::{Subject, task_of};
use crate::report::Findings;
use crate::selection::{Forecasts, align, decide, prepare, prepare_from, with_given, without_motion};
use crate::settings::Settings;

/// Options of a diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Largest number of effects that are added.
    pub max_effects: usize,
    /// Significance level of the test for a lack of fit.
    pub level: f64,
    /// Settings of the method.
    pub settings: Settings,
}

impl Default for Options {
    fn default() -> Self {
        let DiagnosisTask { max_effects, level, .. } = DiagnosisTask::default();
        Self { max_effects, level, settings: Settings::default() }
    }
}

/// Finds what the model of a calibration study lacks: fits the declared model, searches the sets of effects that
/// explain the calibration records, and decides by evidence and forecast which of them are claimed. If the watch stops
/// the search, the diagnosis rests on the sets fitted so far.
///
/// # Errors
/// A study that cannot be diagnosed, a declared model that cannot be simulated, or a stop before the declared model was
/// fitted.
pub fn diagnose(
    study: &Study,
    effects: &[Arc<dyn Effect>],
    options: &Options,
    watch: &dyn Watch,
) -> Result<Diagnosis, StudyError> {
    let Options { max_effects, level, settings } = options;
    let (simulations, given) = (Meter::new(watch), task_of(study).with);
    let (subject, start) = without_motion(Subject::new(study, settings)?, &simulations);
    // Fit of the nominal model, error models, coverage; screening and fits of single effects and pairs.
    let (refit, nominal) = prepare_from(&subject, start, effects, &simulations)?;
    let singles = with_given(&refit, nominal.clone(), &given, *max_effects, *level)?.with_single_effects();
    // Alignment: with inputs that act at other times the search begins again.
    let (aligned, alignment) = align(&singles).unzip();
    let again = aligned.as_ref().and_then(|subject| prepare(subject, effects, &simulations).ok());
    let (again, aligned) = again.unzip();
    let singles = match again.as_ref().zip(aligned) {
        Some((refit, declared)) => with_given(refit, declared, &given, *max_effects, *level)?.with_single_effects(),
        None => singles,
    };
    // Evidence: further effects.
    let sets = singles.searched();
    let is_stopped = simulations.conclude();
    // Free curves, forecast, and what remains.
    let curves = sets.free_curves(&Vec::new());
    let (sets, forecasts) = Forecasts::of(sets);
    let verdict = decide(&sets, &forecasts);
    let alignment = alignment.filter(|_| again.is_some()).unwrap_or_default();
    let findings = Findings { nominal, alignment, curves, sets, forecasts, verdict, is_stopped };
    Ok(findings.diagnosis())
}
