//! The step that makes the models' objective least.

use mops_core::{Shape, Usage};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::barrier::{Promise, violation};
use super::models::Models;
use crate::epigraph::{Multipliers, Rows, Subproblem};

/// What is minimised: the rows of the models as the problem uses them, with an exact penalty.
pub struct Aim<'a> {
    /// Sizes and kinds.
    pub shape: &'a Shape,
    /// Factor of the objective.
    pub unit: f64,
    /// Weight of the largest violation.
    pub penalty: f64,
}

impl Aim<'_> {
    /// The penalised objective of scaled values.
    pub fn worth(&self, scaled: &[f64]) -> f64 {
        let merit = self.shape.merit(scaled);
        self.unit * merit.objective + self.penalty * merit.violation
    }

    fn rows(&self, models: &Models, y: &DVector<f64>) -> Rows {
        Rows::new(self.shape, &models.values(y), &models.slopes(y)).with_objective_times(self.unit)
    }

    /// The curvature of the Lagrangian.
    fn curvature(&self, models: &Models, multipliers: &Multipliers) -> DMatrix<f64> {
        let sum = multipliers.objectives.len() == 1;
        let (mut objective, mut inequality, mut equality) = (0, 0, 0);
        let weights = self.shape.rows.iter().map(|(usage, weight)| match usage {
            Usage::Minimise => {
                let multiplier = multipliers.objectives[if sum { 0 } else { objective }];
                objective += 1;
                self.unit * weight * multiplier
            }
            Usage::Inequality => {
                inequality += 1;
                multipliers.inequalities[inequality - 1]
            }
            Usage::Equality => {
                equality += 1;
                multipliers.equalities[equality - 1]
            }
            Usage::Monitor => 0.0,
        });
        models.curvature(weights)
    }

    /// How much more a unit of violation counts than one of the objective.
    pub fn weight(&self) -> f64 {
        self.penalty / self.unit
    }

    /// What a step of the models promises.
    pub fn promise(&self, models: &Models, y: &DVector<f64>) -> Promise {
        let [before, after] = [&DVector::zeros(y.len()), y].map(|y| self.shape.merit(&models.values(y)));
        Promise { objective: before.objective - after.objective, violation: violation(&before) - violation(&after) }
    }

    /// By how much the penalised objective falls if a promise is kept.
    pub fn worth_of(&self, promise: &Promise) -> f64 {
        (self.unit * promise.objective + self.penalty * promise.violation).max(0.0)
    }

    /// As [`Aim::least`], with a weight of the violation that grows until the violation falls by most of what the models let
    /// it fall.
    ///
    /// Source: R. H. Byrd, J. Nocedal, R. A. Waltz, Optimization Methods and Software 23 (2008) 197-213 (steering).
    pub fn least_violating(&mut self, models: &Models, low: &[f64], high: &[f64]) -> Option<DVector<f64>> {
        let mut step = self.least(models, low, high);
        let after = |step: Option<&DVector<f64>>| {
            let merit = self.shape.merit(&models.values(step.unwrap_or(&DVector::zeros(low.len()))));
            violation(&merit)
        };
        if self.shape.has_constraints() && after(step.as_ref()) > 0.0 {
            let most = Aim { penalty: LARGEST_PENALTY, ..*self }.least(models, low, high);
            let least = after(most.as_ref());
            let wanted = least + 0.1 * (after(None) - least).max(0.0);
            while after(step.as_ref()) > wanted && self.penalty < LARGEST_PENALTY {
                self.penalty *= 10.0;
                step = self.least(models, low, high);
            }
        }
        step
    }

    /// The step to the least of the models' penalised objective over `low <= y <= high`, from `y = 0`, by sequential quadratic
    /// programming on the models, in a trust region of its own and with second-order corrections. `None` where no step lessens
    /// it.
    fn least(&self, models: &Models, low: &[f64], high: &[f64]) -> Option<DVector<f64>> {
        let n = low.len();
        let mut y = DVector::zeros(n);
        let begin = self.worth(&models.values(&y));
        let mut worth = begin;
        let mut rows = self.rows(models, &y);
        let mut multipliers = on_top(&rows);
        let mut subproblem = Subproblem::default();
        let (mut reach, mut failures) = (1.0_f64, 0);
        for _ in 0..ITERATIONS {
            let hessian = convex(self.curvature(models, &multipliers));
            let room_low: Vec<f64> = (0..n).map(|j| (low[j] - y[j]).clamp(-reach, 0.0)).collect();
            let room_high: Vec<f64> = (0..n).map(|j| (high[j] - y[j]).clamp(0.0, reach)).collect();
            let mut solve = |rows: &Rows| subproblem.solve(rows, &hessian, &room_low, &room_high, self.penalty);
            let tried = |step: &[f64]| {
                let there = &y + DVector::from_column_slice(step);
                (self.worth(&models.values(&there)), there)
            };
            let Some(direction) = solve(&rows) else { break };
            let length = direction.step.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
            if length == 0.0 {
                break;
            }
            let (mut found, mut there) = tried(&direction.step);
            if found >= worth
                && let Some(again) = solve(&rows.corrected(&self.rows(models, &there), &direction.step))
            {
                (found, there) = tried(&again.step);
            }
            // Even where the step failed, its multipliers tell more of the curvature.
            multipliers = direction.multipliers;
            if found >= worth {
                failures += 1;
                reach = 0.3 * length.min(reach);
                if failures > FAILURES {
                    break;
                }
                continue;
            }
            let gained = worth - found;
            (y, worth) = (there, found);
            if gained < 1e-3 * (begin - worth) {
                break;
            }
            reach = 2.0 * length.max(reach);
            rows = self.rows(models, &y);
        }
        (worth < begin).then_some(y)
    }
}

/// The largest weight of a violation.
const LARGEST_PENALTY: f64 = 1e7;

/// Quadratic programmes on the models for one step.
const ITERATIONS: usize = 30;

/// Steps of these that may fail.
const FAILURES: usize = 8;

/// At first the largest row has all the weight.
fn on_top(rows: &Rows) -> Multipliers {
    let top = rows.objective();
    let count = rows.objectives.iter().filter(|row| row.value >= top).count();
    #[allow(clippy::cast_precision_loss)]
    let share = 1.0 / count.max(1) as f64;
    Multipliers {
        objectives: rows.objectives.iter().map(|row| if row.value >= top { share } else { 0.0 }).collect(),
        inequalities: vec![0.0; rows.inequalities.len()],
        equalities: vec![0.0; rows.equalities.len()],
    }
}

/// The matrix with the absolute values of its eigenvalues, none much smaller than the largest.
fn convex(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    let size = matrix.amax();
    if !(size.is_finite() && size > 0.0) {
        return DMatrix::identity(n, n) * 1e-9;
    }
    let eigen = SymmetricEigen::new(matrix);
    let least = 1e-8 * eigen.eigenvalues.amax();
    let values = eigen.eigenvalues.map(|value| value.abs().max(least));
    &eigen.eigenvectors * DMatrix::from_diagonal(&values) * eigen.eigenvectors.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kink_of_two_parabolas_is_found() {
        // y^2 and (y - 1)^2 meet at 1/2.
        let steps: Vec<Vec<f64>> = [0.0, 1.0, -1.0].map(|y| vec![y]).into();
        let values: Vec<[f64; 2]> = steps.iter().map(|y| [y[0] * y[0], (y[0] - 1.0).powi(2)]).collect();
        let rows: Vec<&[f64]> = values.iter().map(|v| &v[..]).collect();
        let models = Models::through(&steps, &rows, &vec![DMatrix::zeros(1, 1); 2], 1.0).unwrap();
        let shape = Shape { spacing: vec![0.0], rows: vec![(Usage::Minimise, 1.0); 2], ..Shape::default() };
        let aim = Aim { shape: &shape, unit: 1.0, penalty: 10.0 };
        let y = aim.least(&models, &[-1.0], &[1.0]).unwrap();
        let promise = aim.worth_of(&aim.promise(&models, &y));
        assert!((y[0] - 0.5).abs() < 1e-3 && (promise - 0.75).abs() < 1e-3, "{y} {promise}");
    }

    #[test]
    fn a_step_goes_along_a_curved_constraint() {
        // -y_1 inside the circle y'y <= 1, from its edge at (0, 1): the slopes alone lead straight off the circle.
        let f = |y: &[f64]| [-y[0], y[0] * y[0] + y[1] * y[1]];
        let steps = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [0.7, 0.6]];
        let steps: Vec<Vec<f64>> = steps.map(|y| y.to_vec()).into();
        let values: Vec<[f64; 2]> = steps.iter().map(|y| f(&[y[0], y[1] + 1.0])).collect();
        let rows: Vec<&[f64]> = values.iter().map(|v| &v[..]).collect();
        let models = Models::through(&steps, &rows, &vec![DMatrix::zeros(2, 2); 2], 1.0).unwrap();
        let usages = vec![(Usage::Minimise, 1.0), (Usage::Inequality, 1.0)];
        let shape = Shape { spacing: vec![0.0; 2], rows: usages, ..Shape::default() };
        let mut aim = Aim { shape: &shape, unit: 1.0, penalty: 10.0 };
        let y = aim.least_violating(&models, &[-1.0; 2], &[1.0; 2]).unwrap();
        assert!(y[0] > 0.15 && f(&[y[0], y[1] + 1.0])[1] < 1.0 + 1e-3, "{y}");
    }
}
