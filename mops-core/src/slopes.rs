//! How the criteria of a design change with its tuners, at the point that is reported.

use serde::Serialize;

use crate::criterion::Usage;
use crate::problem::Problem;
use crate::solver::Oracle;

/// The block `slopes` of a result.
#[derive(Debug, Clone, Serialize)]
pub struct SlopesReport {
    /// Names of the tuners that the solver could change.
    pub tuners: Vec<String>,
    /// The criteria that count, each in its case.
    pub criteria: Vec<CriterionSlopes>,
}

/// The slopes of a criterion in a case.
#[derive(Debug, Clone, Serialize)]
pub struct CriterionSlopes {
    /// Its key, `case/criterion`.
    pub key: String,
    /// For every tuner: the derivative of the scaled value by the tuner's place within its bounds (0 at the lower, 1 at the
    /// upper; logarithmic where the tuner is). A hundredth of it is what a step of 1 % of the range changes, to first order.
    pub slopes: Vec<f64>,
}

impl SlopesReport {
    /// The slopes at a point of the unit box, as `oracle` gives them within `reach`; `None` where a simulation near it fails,
    /// or where nothing can be changed.
    pub fn at(problem: &Problem, oracle: &mut dyn Oracle, point: &[f64], reach: f64) -> Option<Self> {
        if point.is_empty() {
            return None;
        }
        let found = oracle.linearise(point, reach).ok().flatten()?;
        let study = problem.study();
        let counts = |(i, _): &(usize, _)| problem.shape().rows[*i].0 != Usage::Monitor;
        let rows = study.rows.iter().enumerate().filter(counts);
        Some(Self {
            tuners: problem.active().iter().map(|&i| study.tuners[i].name.clone()).collect(),
            criteria: rows
                .map(|(i, row)| CriterionSlopes { key: study.key(row), slopes: found.rows[i].clone() })
                .collect(),
        })
    }
}
