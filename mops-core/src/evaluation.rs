//! Evaluations of points: the readings of the criteria, and the order of points.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::failure::Failure;

/// Tolerance of constraints, in scaled values.
pub const FEASIBLE: f64 = 1e-6;

/// Combination of the scaled values into one objective.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Objective {
    /// Largest weighted scaled value.
    #[default]
    Max,
    /// Sum of the weighted scaled values.
    Sum,
    /// Vector of all scaled values: the run keeps the Pareto front. The reported point is the front point with the
    /// smallest largest scaled value.
    Each,
}

/// Evaluation of a point.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// Point of the unit box.
    pub point: Vec<f64>,
    /// Values of all tuners of the study.
    pub tuners: Vec<f64>,
    /// Readings, one per row of the study; `None` if its simulation failed or was not run.
    pub readings: Vec<Option<Reading>>,
    /// Scaled values of all rows, 0 for monitored ones; `None` if a row that counts has no value.
    pub scaled: Option<Vec<f64>>,
    /// Weighted residuals whose sum of squares is the objective; empty if the objective is not a sum of squares. A
    /// solver gets them from [`crate::Oracle::linearise`], as those of earlier points are not kept.
    pub residuals: Vec<f64>,
    /// Failures: index of the job, and the reason.
    pub failures: Vec<(usize, Failure)>,
    /// Merit of the point.
    pub merit: Merit,
}

impl Evaluation {
    /// Returns true if a simulation was cancelled, so that the evaluation is incomplete.
    pub fn is_cancelled(&self) -> bool {
        self.failures.iter().any(|(_, failure)| *failure == Failure::Cancelled)
    }
}

/// The value of a criterion in a case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Value, in the criterion's unit; NaN if the condition of the criterion was never reached.
    pub value: f64,
    /// Value scaled by the demand.
    pub scaled: f64,
    /// Derivative of the scaled value with respect to the number of the criterion.
    pub(crate) slope: f64,
    /// Remark on the value.
    pub note: Option<&'static str>,
}

/// Merit of a point; [`Merit::is_better_than`] orders points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Merit {
    /// Largest constraint violation, in scaled values; infinite for a failed point.
    pub violation: f64,
    /// Objective; infinite for a failed point.
    pub objective: f64,
}

impl Merit {
    /// Merit of a failed point: worse than every other.
    pub const FAILED: Self = Self { violation: f64::INFINITY, objective: f64::INFINITY };

    /// Returns true if every constraint is satisfied to within [`FEASIBLE`].
    pub fn is_feasible(&self) -> bool {
        self.violation <= FEASIBLE
    }

    /// Returns true if this merit is better. Feasible points come first, ordered by objective; then infeasible ones by
    /// violation; then failed ones.
    pub fn is_better_than(&self, other: &Self) -> bool {
        match (self.is_feasible(), other.is_feasible()) {
            (true, true) => self.objective < other.objective,
            (feasible, other_feasible) if feasible != other_feasible => feasible,
            _ => (self.violation, self.objective) < (other.violation, other.objective),
        }
    }
}
