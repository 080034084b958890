//! Times of a simulation: those that an option gives, and those that are one instant.

use mops_core::StudyError;
use mops_language::{Quantity, Scalar, Unit};

/// Returns the time in s that a model's options give under `key`.
///
/// # Errors
/// The quantity is not a time.
pub fn seconds(key: &str, time: Option<&Quantity>) -> Result<Option<f64>, StudyError> {
    time.map(|q| q.to(&Unit::known("s"))).transpose().map_err(|e| StudyError::new(key, e))
}

/// Relative difference of two times up to which they are the same instant: 3 times 0.1 s is 0.3 s.
const SAME_INSTANT: f64 = 8.0 * f64::EPSILON;

/// Returns the latest time that is the same instant as `t`.
pub(crate) fn latest(t: f64) -> f64 {
    t + SAME_INSTANT * t.abs()
}

/// Returns true if `t` has reached a time, within rounding.
pub(crate) fn is_due(time: f64, t: f64) -> bool {
    time <= latest(t)
}

/// Returns the first of these times; of those at the same instant, the last, so that all are due.
pub(crate) fn next_of(times: impl Iterator<Item = f64> + Clone) -> f64 {
    let first = times.clone().fold(f64::INFINITY, f64::min);
    times.filter(|&time| is_due(time, first)).fold(first, f64::max)
}

/// Difference of the derivatives of two times, relative to the larger one, up to which they are the same.
const SAME: f64 = 1e-6;

/// Returns the derivatives of the time of two coincident instants; NaN if they differ.
pub(crate) fn common<S: Scalar>(a: S, b: S) -> S {
    let size = a.tangents().iter().chain(b.tangents()).fold(0.0, |most: f64, d| most.max(d.abs()));
    let is_same = a.tangents().iter().zip(b.tangents()).all(|(a, b)| (a - b).abs() <= SAME * size);
    if is_same { a } else { a * f64::NAN }
}
