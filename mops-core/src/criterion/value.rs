//! Value of a criterion, and what a study does with it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which values of a criterion are better.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sense {
    /// Smaller values: a demand is an upper limit.
    Less,
    /// Larger values: a demand is a lower limit.
    More,
    /// Values near a target: a single demand is ambiguous.
    Target,
    /// Not fixed by the kind, as for the value of a signal. A demand is an upper limit; a pair `good`, `bad` sets
    /// either direction.
    #[default]
    Open,
}

/// Smallest share by which the number of a missed criterion exceeds 1. The share is larger than the constraint
/// tolerance
/// [`crate::evaluation::FEASIBLE`], so that a missed criterion never meets its demand.
pub(super) const LEAST_MISS: f64 = 1e-5;

/// The value of a criterion.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Value {
    /// The number, in the criterion's unit.
    pub number: f64,
    /// Terms before squaring if the number is a sum of squares: `number = sum r_i^2`; else empty.
    pub residuals: Vec<f64>,
    /// Remark on the number, such as `not settled at the end`.
    pub note: Option<&'static str>,
    /// Set if the condition of the criterion was never reached. `number` is then a measure of the distance, see
    /// [`Missed`].
    pub missed: Option<Missed>,
}

/// A condition of a criterion, such as settling, that was not reached in a simulation or at any frequency.
///
/// The criterion then has no value, and no demand is met. To guide solvers, the number is `h (1 + e/(e + b))`. `h` is
/// the time available to reach the condition, in the criterion's unit. For a criterion that is not a time, `h` is 1 and
/// the number a ratio, whatever the unit. `e` is the distance of the response from its target and `b` the tolerance.
/// [`crate::Demand::scaled`] defines the scaled value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Missed {
    /// Time available to reach the condition, in the criterion's unit; `None` if the criterion is not a time.
    pub horizon: Option<f64>,
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self { number, ..Self::default() }
    }
}

impl Value {
    /// Returns a value with a remark.
    pub fn noted(number: f64, note: &'static str) -> Self {
        Self { number, note: Some(note), ..Self::default() }
    }

    /// Returns the value of a missed criterion. `horizon` is the available time in s if the criterion is a time.
    /// `distance` is the distance of the response from its target and `near` the tolerance, in the same unit.
    pub fn missed(horizon: Option<f64>, distance: f64, near: f64, note: &'static str) -> Self {
        let share = (distance / (distance + near)).clamp(LEAST_MISS, 1.0);
        let number = horizon.unwrap_or(1.0) * (1.0 + if share.is_nan() { 1.0 } else { share });
        Self { number, note: Some(note), missed: Some(Missed { horizon }), ..Self::default() }
    }

    /// Returns the derivative of [`Value::sum_of_squares`], given the residuals and their derivatives.
    pub fn slope_of_squares(residuals: &[f64], slopes: Vec<f64>) -> Self {
        let number = residuals.iter().zip(&slopes).map(|(r, slope)| 2.0 * r * slope).sum();
        Self { number, residuals: slopes, ..Self::default() }
    }

    /// Returns the sum of squares of `residuals`.
    pub fn sum_of_squares(residuals: Vec<f64>) -> Self {
        Self { number: residuals.iter().map(|r| r * r).sum(), residuals, ..Self::default() }
    }
}

/// Usage of a criterion in a study.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Usage {
    /// Part of the objective.
    #[default]
    Minimise,
    /// Constraint: the scaled value must be at most 1.
    Inequality,
    /// Constraint: the scaled value must be 1.
    Equality,
    /// Reported only.
    Monitor,
}
