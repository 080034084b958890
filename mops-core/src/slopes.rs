//! Derivatives of the criteria of a design with respect to its tuners, at the reported point.

use schemars::JsonSchema;
use serde::Serialize;

use crate::criterion::Usage;
use crate::problem::Problem;
use crate::solver::Linearisation;

/// The block `slopes` of a result.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SlopesReport {
    /// Names of the tuners that the solver could change.
    pub tuners: Vec<String>,
    /// Criteria that count, one entry per case.
    pub criteria: Vec<CriterionSlopes>,
}

/// Derivatives of a criterion in a case.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CriterionSlopes {
    /// Key, `case/criterion`.
    pub key: String,
    /// Derivative of the scaled value with respect to the position of each tuner within its bounds. The position is 0 at the
    /// lower and 1 at the upper bound, logarithmic for logarithmic tuners. A hundredth of the derivative is the first-order
    /// change for a step of 1 % of the range.
    pub slopes: Vec<f64>,
}

impl SlopesReport {
    /// Returns the derivatives of a linearisation.
    pub fn of(problem: &Problem, found: &Linearisation) -> Self {
        let study = problem.study();
        let counts = |(i, _): &(usize, _)| problem.shape().rows[*i].0 != Usage::Monitor;
        let rows = study.rows.iter().enumerate().filter(counts);
        Self {
            tuners: problem.active().iter().map(|&i| study.tuners[i].name.clone()).collect(),
            criteria: rows
                .map(|(i, row)| CriterionSlopes { key: study.key(row), slopes: found.rows[i].clone() })
                .collect(),
        }
    }
}
