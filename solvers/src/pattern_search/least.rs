//! The step that makes the models' objective least.

use mops_core::math;
use mops_core::{Shape, Usage};
use nalgebra::DMatrix;

use super::barrier::{Promise, violation};
use super::models::Models;
use crate::definite::cholesky;
use crate::epigraph::{Direction, Subproblem};
use crate::rows::{Multipliers, Rows};

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

    /// The rows of the models, with given values, after a step.
    fn rows(&self, models: &Models, y: &[f64], values: &[f64], rows: &mut Rows) {
        rows.fill(self.shape, values, y.len(), |row, weight, sum| models.add_slope(row, y, weight, sum));
        rows.multiply_objective(self.unit);
    }

    /// The curvature of the Lagrangian.
    fn curvature(&self, models: &Models, multipliers: &Multipliers, curvature: &mut DMatrix<f64>) {
        let sum = multipliers.objectives.len() == 1;
        let (mut objective, mut inequality, mut equality) = (0, 0, 0);
        curvature.fill(0.0);
        for (row, (usage, weight)) in self.shape.rows.iter().enumerate() {
            let weight = match usage {
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
                Usage::Monitor => continue,
            };
            models.add_curvature(row, weight, curvature);
        }
    }

    /// How much more a unit of violation counts than one of the objective.
    pub fn weight(&self) -> f64 {
        self.penalty / self.unit
    }

    /// What a step promises that leads from some scaled values to others.
    pub fn promise(&self, from: &[f64], to: &[f64]) -> Promise {
        let [before, after] = [from, to].map(|scaled| self.shape.merit(scaled));
        Promise { objective: before.objective - after.objective, violation: violation(&before) - violation(&after) }
    }

    /// By how much the penalised objective falls if a promise is kept.
    pub fn worth_of(&self, promise: &Promise) -> f64 {
        (self.unit * promise.objective + self.penalty * promise.violation).max(0.0)
    }
}

/// The search for the least of the models' penalised objective, with its memory, which is used again from step to step.
#[derive(Default)]
pub struct Least {
    /// The step that was found.
    y: Vec<f64>,
    /// The values of all rows after it.
    values: Vec<f64>,
    /// Another step, and the values after it.
    there: Vec<f64>,
    values_there: Vec<f64>,
    /// The first step and its values, while others are looked at.
    first: [Vec<f64>; 2],
    rows: Rows,
    rows_there: Rows,
    corrected: Rows,
    hessian: DMatrix<f64>,
    factor: Vec<f64>,
    multipliers: Multipliers,
    /// The box around the step.
    low: Vec<f64>,
    high: Vec<f64>,
    directions: [Direction; 2],
    subproblem: Subproblem,
}

impl Least {
    /// The step that was found.
    pub fn step(&self) -> &[f64] {
        &self.y
    }

    /// The models' values after it.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Finds the step to the least of the models' penalised objective over `low <= y <= high`, with a weight of the violation
    /// that grows until the violation falls by most of what the models let it fall. `false` where no step lessens it.
    ///
    /// Source: R. H. Byrd, J. Nocedal, R. A. Waltz, Optimization Methods and Software 23 (2008) 197-213 (steering).
    pub fn find(&mut self, aim: &mut Aim, models: &Models, low: &[f64], high: &[f64]) -> bool {
        let mut found = self.search(aim, models, low, high);
        let mut left = self.violation(aim.shape);
        if left == 0.0 {
            return found;
        }
        self.swap_first();
        self.search(&Aim { penalty: LARGEST_PENALTY, ..*aim }, models, low, high);
        let least = self.violation(aim.shape);
        let before = violation(&aim.shape.merit(models.constants()));
        let wanted = least + 0.1 * (before - least).max(0.0);
        if left <= wanted || aim.penalty >= LARGEST_PENALTY {
            self.swap_first();
            return found;
        }
        while left > wanted && aim.penalty < LARGEST_PENALTY {
            aim.penalty *= 10.0;
            found = self.search(aim, models, low, high);
            left = self.violation(aim.shape);
        }
        found
    }

    fn swap_first(&mut self) {
        std::mem::swap(&mut self.y, &mut self.first[0]);
        std::mem::swap(&mut self.values, &mut self.first[1]);
    }

    /// What the models leave violated after the step.
    fn violation(&self, shape: &Shape) -> f64 {
        violation(&shape.merit(&self.values))
    }

    /// As [`Least::find`], from `y = 0`, by sequential quadratic programming on the models, in a trust region of its own and
    /// with second-order corrections.
    fn search(&mut self, aim: &Aim, models: &Models, low: &[f64], high: &[f64]) -> bool {
        let n = low.len();
        let Self { y, values, there, values_there, rows, rows_there, corrected, hessian, factor, .. } = self;
        let Self { multipliers, low: inner_low, high: inner_high, subproblem, .. } = self;
        let [direction, again] = &mut self.directions;
        if hessian.nrows() != n {
            *hessian = DMatrix::zeros(n, n);
        }
        y.clear();
        y.resize(n, 0.0);
        values.clear();
        values.extend_from_slice(models.constants());
        let begin = aim.worth(values);
        let mut worth = begin;
        aim.rows(models, y, values, rows);
        on_top(rows, multipliers);
        let (mut reach, mut failures) = (1.0_f64, 0);
        for _ in 0..INNER_ITERATIONS {
            aim.curvature(models, multipliers, hessian);
            make_convex(hessian, factor);
            inner_low.clear();
            inner_low.extend(low.iter().zip(&*y).map(|(low, y)| (low - y).clamp(-reach, 0.0)));
            inner_high.clear();
            inner_high.extend(high.iter().zip(&*y).map(|(high, y)| (high - y).clamp(0.0, reach)));
            let mut try_step = |y: &[f64], step: &[f64], values: &mut Vec<f64>| {
                there.clear();
                there.extend(y.iter().zip(step).map(|(y, d)| y + d));
                models.values(there, values);
                aim.worth(values)
            };
            if subproblem.solve(rows, hessian, [inner_low, inner_high], aim.penalty, direction).is_none() {
                break;
            }
            let length = direction.step.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
            if length == 0.0 {
                break;
            }
            let mut found = try_step(y, &direction.step, values_there);
            if found >= worth {
                rows_there.evaluate(aim.shape, values_there);
                rows_there.multiply_objective(aim.unit);
                corrected.correct(rows, rows_there, &direction.step);
                if subproblem.solve(corrected, hessian, [inner_low, inner_high], aim.penalty, again).is_some() {
                    found = try_step(y, &again.step, values_there);
                }
            }
            // Even where the step failed, its multipliers tell more of the curvature.
            std::mem::swap(multipliers, &mut direction.multipliers);
            if found >= worth {
                failures += 1;
                reach = 0.3 * length.min(reach);
                if failures > INNER_FAILURES {
                    break;
                }
                continue;
            }
            let gained = worth - found;
            worth = found;
            std::mem::swap(y, there);
            std::mem::swap(values, values_there);
            if gained < 1e-3 * (begin - worth) {
                break;
            }
            reach = 2.0 * length.max(reach);
            aim.rows(models, y, values, rows);
        }
        worth < begin
    }
}

/// The largest weight of a violation.
const LARGEST_PENALTY: f64 = 1e7;

/// Quadratic programmes on the models for one step.
const INNER_ITERATIONS: usize = 30;

/// Steps of these that may fail.
const INNER_FAILURES: usize = 8;

/// At first the largest row has all the weight.
fn on_top(rows: &Rows, multipliers: &mut Multipliers) {
    let top = rows.objective();
    let count = rows.objectives.iter().filter(|row| row.value >= top).count();
    #[allow(clippy::cast_precision_loss)]
    let share = 1.0 / count.max(1) as f64;
    multipliers.objectives.clear();
    multipliers.objectives.extend(rows.objectives.iter().map(|row| if row.value >= top { share } else { 0.0 }));
    multipliers.inequalities.clear();
    multipliers.inequalities.resize(rows.inequalities.len(), 0.0);
    multipliers.equalities.clear();
    multipliers.equalities.resize(rows.equalities.len(), 0.0);
}

/// The first multiple of the identity that is added to a matrix that is not positive definite, relative to its norm.
const ADDED: f64 = 1e-3;

/// What the smallest eigenvalue is to exceed, relative to the largest entry.
const POSITIVE: f64 = 1e-8;

/// Makes a symmetric matrix positive definite, where it is not, by a multiple of the identity; one that is 0 or not finite
/// becomes a small multiple itself.
///
/// Source: J. Nocedal, S. Wright, Numerical Optimization, 2nd edition (2006), algorithm 3.3.
///
/// N.B.: their first multiple is an absolute number, and they ask for no margin. A matrix with flat directions alone gets just
/// the margin: flat directions are the rule where few points tell of the curvature.
fn make_convex(matrix: &mut DMatrix<f64>, factor: &mut Vec<f64>) {
    let n = matrix.nrows();
    let size = matrix.iter().fold(0.0_f64, |most, h| if h.is_finite() { most.max(h.abs()) } else { f64::INFINITY });
    if !(size.is_finite() && size > 0.0) {
        matrix.fill_with_identity();
        *matrix *= 1e-9;
        return;
    }
    // In units of the largest entry, so that nothing overflows: no eigenvalue is below -n.
    let least = (0..n).map(|i| matrix[(i, i)]).fold(f64::INFINITY, f64::min) / size;
    let first = ADDED * matrix.iter().map(|h| math::powi(h / size, 2)).sum::<f64>().sqrt();
    let mut added = if least > -POSITIVE { 0.0 } else { first - least };
    loop {
        factor.clear();
        factor.extend(matrix.iter().map(|h| h / size));
        (0..n).for_each(|i| factor[i * n + i] += added - POSITIVE);
        if cholesky(factor, n, n) {
            (0..n).for_each(|i| matrix[(i, i)] += added * size);
            return;
        }
        added = if added == 0.0 { 2.0 * POSITIVE } else { first.max(2.0 * added) };
    }
}

#[cfg(test)]
mod tests {
    use super::super::models::tests::through;
    use super::*;

    #[test]
    fn the_kink_of_two_parabolas_is_found() {
        // y^2 and (y - 1)^2 meet at 1/2.
        let models = through(&[[0.0], [1.0], [-1.0]], |y| vec![y[0] * y[0], math::powi(y[0] - 1.0, 2)]);
        let shape = Shape { spacing: vec![0.0], rows: vec![(Usage::Minimise, 1.0); 2], ..Shape::default() };
        let mut aim = Aim { shape: &shape, unit: 1.0, penalty: 10.0 };
        let mut least = Least::default();
        assert!(least.find(&mut aim, &models, &[-1.0], &[1.0]));
        let promise = aim.worth_of(&aim.promise(models.constants(), least.values()));
        assert!((least.step()[0] - 0.5).abs() < 1e-3 && (promise - 0.75).abs() < 1e-3, "{:?} {promise}", least.step());
    }

    #[test]
    fn a_step_goes_along_a_curved_constraint() {
        // -y_1 inside the circle y'y <= 1, from its edge at (0, 1): the slopes alone lead straight off the circle.
        let f = |y: &[f64]| vec![-y[0], y[0] * y[0] + y[1] * y[1]];
        let steps = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [0.7, 0.6]];
        let models = through(&steps, |y| f(&[y[0], y[1] + 1.0]));
        let usages = vec![(Usage::Minimise, 1.0), (Usage::Inequality, 1.0)];
        let shape = Shape { spacing: vec![0.0; 2], rows: usages, ..Shape::default() };
        let mut aim = Aim { shape: &shape, unit: 1.0, penalty: 10.0 };
        let mut least = Least::default();
        assert!(least.find(&mut aim, &models, &[-1.0; 2], &[1.0; 2]));
        let y = least.step();
        assert!(y[0] > 0.15 && f(&[y[0], y[1] + 1.0])[1] < 1.0 + 1e-3, "{y:?}");
    }

    #[test]
    fn a_matrix_becomes_convex_by_a_multiple_of_the_identity() {
        let mut factor = Vec::new();
        let convex = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
        let mut matrix = convex.clone();
        make_convex(&mut matrix, &mut factor);
        assert_eq!(matrix, convex);
        // Eigenvalues 3 and -1: at least 1 has to be added, and no more than twice as much is.
        let indefinite = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]);
        for size in [1.0, 1e-300, 1e300] {
            let mut matrix = &indefinite * size;
            make_convex(&mut matrix, &mut factor);
            let added = matrix / size - &indefinite;
            assert!(added[(0, 0)] > 1.0 && added[(0, 0)] <= 2.1, "{added}");
            assert!((&added - DMatrix::identity(2, 2) * added[(0, 0)]).amax() < 1e-12);
        }
        let mut flat = DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 0.0, 0.0]);
        make_convex(&mut flat, &mut factor);
        assert!(flat[(1, 1)] > 1e-8 && flat[(1, 1)] < 1e-7, "{flat}");
        let mut matrix = DMatrix::from_element(2, 2, f64::NAN);
        make_convex(&mut matrix, &mut factor);
        assert_eq!(matrix, DMatrix::identity(2, 2) * 1e-9);
    }
}
