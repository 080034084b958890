//! Derivatives of the criteria of a design with respect to its tuners, at the reported point.

use schemars::JsonSchema;
use serde::Serialize;

use crate::criterion::Usage;
use crate::evaluation::Evaluation;
use crate::problem::Problem;
use crate::solver::{Linearisation, Oracle};

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
    /// Derivatives to the left and to the right for each tuner, where they differ: at a kink, or at a jump, where they grow without
    /// limit. Null where they agree; absent for a criterion without such a tuner.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sides: Option<Vec<Option<[f64; 2]>>>,
}

/// Distance of the points that separate the derivatives of both sides, in the unit box: differences of values that repeat to 1e-9 are
/// accurate to 1e-5.
const BESIDE: f64 = 2e-4;

/// Difference of the derivatives of both sides, relative to the larger one, from which they are reported apart.
const APART: f64 = 0.1;

/// Change over the whole range of a tuner, in scaled values, whose sides are not reported apart.
const SMALL: f64 = 1e-3;

impl SlopesReport {
    /// Returns the derivatives of a linearisation.
    pub fn of(problem: &Problem, found: &Linearisation) -> Self {
        let study = problem.study();
        let counts = |(i, _): &(usize, _)| problem.shape().rows[*i].0 != Usage::Monitor;
        let rows = study.rows.iter().enumerate().filter(counts);
        Self {
            tuners: problem.active().iter().map(|&i| study.tuners[i].name.clone()).collect(),
            criteria: rows
                .map(|(i, row)| CriterionSlopes { key: study.key(row), slopes: found.rows[i].clone(), sides: None })
                .collect(),
        }
    }

    /// Adds the derivatives of both sides, by differences: two points for every tuner. Without enough budget, nothing is added.
    pub fn add_sides(&mut self, problem: &Problem, oracle: &mut dyn Oracle, at: &Evaluation) {
        let moved = |j: usize, step: f64| {
            let mut point = at.point.clone();
            point[j] += step;
            (0.0..=1.0).contains(&point[j]).then_some(point)
        };
        let pairs: Vec<(usize, [Vec<f64>; 2])> =
            (0..at.point.len()).filter_map(|j| Some((j, [moved(j, -BESIDE)?, moved(j, BESIDE)?]))).collect();
        let points: Vec<Vec<f64>> = pairs.iter().flat_map(|(_, pair)| pair.clone()).collect();
        if oracle.remaining() < points.len() {
            return;
        }
        let Ok(found) = oracle.evaluate(&points) else { return };
        let counts = (0..problem.study().rows.len()).filter(|i| problem.shape().rows[*i].0 != Usage::Monitor);
        for (i, criterion) in counts.zip(&mut self.criteria) {
            let mut sides = vec![None; at.point.len()];
            for ((j, _), pair) in pairs.iter().zip(found.chunks(2)) {
                let value = |of: &Evaluation| of.scaled.as_ref().map(|scaled| scaled[i]);
                let (Some(here), Some(left), Some(right)) = (value(at), value(&pair[0]), value(&pair[1])) else {
                    continue;
                };
                let both = [(here - left) / BESIDE, (right - here) / BESIDE];
                let larger = both[0].abs().max(both[1].abs());
                if (both[0] - both[1]).abs() > APART * larger + SMALL {
                    sides[*j] = Some(both);
                }
            }
            criterion.sides = sides.iter().any(Option::is_some).then_some(sides);
        }
    }
}
