//! The step that makes the models' objective least.

use mops_core::{Shape, Usage};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::models::Models;
use crate::epigraph::{self, Multipliers, Rows};

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

    /// The least of the models' penalised objective over `low <= y <= high`, from `y = 0`, by sequential quadratic programming
    /// on the models: the step, and what it promises. `None` where it promises nothing.
    pub fn least(&self, models: &Models, low: &[f64], high: &[f64]) -> Option<(DVector<f64>, f64)> {
        let n = low.len();
        let mut y = DVector::zeros(n);
        let begin = self.worth(&models.values(&y));
        let mut worth = begin;
        let mut rows = self.rows(models, &y);
        // At first the largest row has all the weight.
        let top = rows.objective();
        let on_top = rows.objectives.iter().filter(|row| row.value >= top).count();
        #[allow(clippy::cast_precision_loss)]
        let share = 1.0 / on_top.max(1) as f64;
        let mut multipliers = Multipliers {
            objectives: rows.objectives.iter().map(|row| if row.value >= top { share } else { 0.0 }).collect(),
            inequalities: vec![0.0; rows.inequalities.len()],
            equalities: vec![0.0; rows.equalities.len()],
        };
        for _ in 0..12 {
            let hessian = convex(self.curvature(models, &multipliers));
            let room_low: Vec<f64> = (0..n).map(|j| (low[j] - y[j]).min(0.0)).collect();
            let room_high: Vec<f64> = (0..n).map(|j| (high[j] - y[j]).max(0.0)).collect();
            let Some(direction) = epigraph::solve(&rows, &hessian, &room_low, &room_high, self.penalty) else { break };
            let step = DVector::from_vec(direction.step);
            let shorter = [1.0, 0.5, 0.25, 0.1, 0.03].into_iter().map(|t| &y + &step * t);
            let better = shorter.map(|y| (self.worth(&models.values(&y)), y)).find(|(found, _)| *found < worth);
            let Some((found, there)) = better else { break };
            let gained = worth - found;
            (y, worth) = (there, found);
            if gained < 1e-3 * (begin - worth) {
                break;
            }
            rows = self.rows(models, &y);
            multipliers = direction.multipliers;
        }
        (worth < begin).then_some((y, begin - worth))
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
        let (y, promise) = aim.least(&models, &[-1.0], &[1.0]).unwrap();
        assert!((y[0] - 0.5).abs() < 1e-3 && (promise - 0.75).abs() < 1e-3, "{y} {promise}");
    }
}
