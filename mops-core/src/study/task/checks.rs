//! Checks that several tasks make.

use crate::study::{Study, StudyError};

/// Largest number of samples.
pub(super) const MOST_SAMPLES: usize = 10_000_000;

/// Checks a count.
pub(super) fn count(key: &str, number: usize, least: usize, most: usize) -> Result<(), StudyError> {
    if (least..=most).contains(&number) {
        return Ok(());
    }
    Err(StudyError::new(key, format!("expected `{key}` from {least} to {most}, found {number}"))
        .with_help("omit it for the default"))
}

/// Checks a confidence level.
pub(super) fn level(level: f64) -> Result<(), StudyError> {
    if (0.5..1.0).contains(&level) {
        return Ok(());
    }
    Err(StudyError::new("level", format!("expected a confidence level from 0.5 to below 1, found {level}"))
        .with_help("with the default 0.95, one interval in twenty misses the true value"))
}

/// Checks that the study has uncertain parameters, if it performs a task over them.
pub(super) fn needs_uncertain(study: &Study) -> Result<(), StudyError> {
    if study.uncertain().is_empty() {
        return Err(no_uncertain("task").within("study"));
    }
    Ok(())
}

pub(super) fn no_uncertain(key: &str) -> StudyError {
    StudyError::new(key, "the study has no uncertain parameter")
        .with_help("add [uncertain] with NAME = { min = ..., max = ... } for parameters of the model")
}

/// Checks that all uncertain parameters are bounded.
pub(super) fn needs_box(study: &Study) -> Result<(), StudyError> {
    let Some(uncertain) = study.uncertain().iter().find(|uncertain| !uncertain.is_bounded()) else { return Ok(()) };
    let fact = format!("a box needs two finite bounds, but `{}` has a missing one", uncertain.name);
    Err(StudyError::new(&uncertain.name, fact).with_help("set `min` and `max`").within("uncertain"))
}
