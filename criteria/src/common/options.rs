//! Options that several criteria have, and the signals that they read.

use mops_core::{Analysis, StudyError, Trace};
use mops_language::{Quantity, Unit};

/// Range of nonnegative values.
pub const NOT_NEGATIVE: [f64; 2] = [0.0, f64::INFINITY];

/// Returns an option as a number in `unit`.
pub fn number(key: &str, option: &Quantity, unit: &Unit) -> Result<f64, StudyError> {
    let number = option.to(unit).map_err(|why| StudyError::new(key, why))?;
    if number.is_finite() {
        Ok(number)
    } else {
        Err(StudyError::new(key, format!("`{key}` must be finite, not {number}")))
    }
}

/// Returns an optional option as a number in `unit`.
pub fn optional(key: &str, option: Option<&Quantity>, unit: &Unit) -> Result<Option<f64>, StudyError> {
    option.map(|option| number(key, option, unit)).transpose()
}

/// Returns an optional positive option as a number in `unit`; a temperature is a difference.
pub fn positive(key: &str, option: Option<&Quantity>, unit: &Unit) -> Result<Option<f64>, StudyError> {
    match optional(key, option, &unit.difference())? {
        Some(number) if number <= 0.0 => {
            Err(StudyError::new(key, format!("`{key}` must be positive, not {}", unit.amount(number))))
        }
        number => Ok(number),
    }
}

/// Returns the time of the step, s; 0 if absent.
pub fn step_time(option: Option<&Quantity>) -> Result<f64, StudyError> {
    match optional("step-time", option, &second())? {
        Some(time) if time < 0.0 => {
            Err(StudyError::new("step-time", format!("the step at {time} s is before the start of the simulation")))
        }
        time => Ok(time.unwrap_or(0.0)),
    }
}

/// Returns the unit of time.
pub fn second() -> Unit {
    Unit::known("s")
}

/// Returns the trace of a signal, or an error if it is not finite, because comparisons ignore NaN silently.
pub fn trace<'a>(analysis: &'a Analysis, signal: &str) -> Result<&'a Trace, String> {
    let trace = analysis.trace(signal);
    if trace.is_empty() {
        return Err(format!("the simulation of `{signal}` has zero length"));
    }
    if trace.is_finite() { Ok(trace) } else { Err(format!("`{signal}` is not finite throughout")) }
}
