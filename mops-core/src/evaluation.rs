//! What a point is worth: the readings of its criteria, and how points are ordered.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::failure::Failure;

/// Constraints count as satisfied up to this much of their scaled value.
pub const FEASIBLE: f64 = 1e-6;

/// How the scaled values become one number to minimise.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Objective {
    /// The largest weighted scaled value.
    #[default]
    Max,
    /// The sum of the weighted scaled values.
    Sum,
    /// None: each counts for itself, and the run keeps the front of points that no other is better than in all of them.
    /// The point reported is that of the front whose largest is least.
    Each,
}

/// What a point is worth.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// The point of the unit box.
    pub point: Vec<f64>,
    /// Values of all tuners of the study.
    pub tuners: Vec<f64>,
    /// A reading per row of the study; `None` where its simulation failed or was not run.
    pub readings: Vec<Option<Reading>>,
    /// Scaled values of all rows, 0 for those that are only watched; `None` if a row that counts has no value.
    pub scaled: Option<Vec<f64>>,
    /// Weighted residuals whose sum of squares is the objective; empty if it is no sum of squares.
    pub residuals: Vec<f64>,
    /// What failed: index of the job, and why.
    pub failures: Vec<(usize, Failure)>,
    /// What it is worth.
    pub merit: Merit,
}

impl Evaluation {
    /// Whether one of its simulations was asked to end before it was done: it says nothing of the point.
    pub fn is_cancelled(&self) -> bool {
        self.failures.iter().any(|(_, failure)| *failure == Failure::Cancelled)
    }
}

/// The value of a criterion in a case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// In the criterion's unit; NaN where it was never reached.
    pub value: f64,
    /// The scaled value, under its demand.
    pub scaled: f64,
    /// Derivative of the scaled value with respect to the number of the criterion.
    pub(crate) slope: f64,
    /// What a reader must know of it.
    pub note: Option<&'static str>,
}

/// What a point is worth; [`Merit::is_better_than`] orders points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Merit {
    /// The largest violation of a constraint, in scaled values; infinite for a failed point.
    pub violation: f64,
    /// The objective; infinite for a failed point.
    pub objective: f64,
}

impl Merit {
    /// A point without a value: worse than every other.
    pub const FAILED: Self = Self { violation: f64::INFINITY, objective: f64::INFINITY };

    /// Whether every constraint holds to within [`FEASIBLE`].
    pub fn is_feasible(&self) -> bool {
        self.violation <= FEASIBLE
    }

    /// Feasible points by their objective, before all others by their violation; failed points last.
    pub fn is_better_than(&self, other: &Self) -> bool {
        match (self.is_feasible(), other.is_feasible()) {
            (true, true) => self.objective < other.objective,
            (feasible, other_feasible) if feasible != other_feasible => feasible,
            _ => (self.violation, self.objective) < (other.violation, other.objective),
        }
    }
}
