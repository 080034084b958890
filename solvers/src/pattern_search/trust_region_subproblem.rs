//! Trust-region subproblem: minimisation of the penalised objective of the models.

use mops_core::{Shape, Usage};
use mops_math as math;
use nalgebra::DMatrix;

use super::barrier::{PredictedReduction, violation};
use super::quadratic_models::QuadraticModels;
use crate::cholesky::factorise;
use crate::epigraph::{Direction, Subproblem};
use crate::linearised_criteria::{LinearisedCriteria, Multipliers};

/// Objective of the models with an exact penalty for the constraints.
pub struct PenalisedObjective<'a> {
    /// Problem dimensions, usages and weights.
    pub shape: &'a Shape,
    /// Scale factor of the objective.
    pub objective_scale: f64,
    /// Weight of the largest violation.
    pub penalty: f64,
}

impl PenalisedObjective<'_> {
    /// Returns the penalised objective of scaled values.
    pub fn value(&self, scaled: &[f64]) -> f64 {
        let merit = self.shape.merit(scaled);
        self.objective_scale * merit.objective + self.penalty * merit.violation
    }

    /// Linearises the models after a step with given values.
    fn linearise(&self, models: &QuadraticModels, y: &[f64], values: &[f64], criteria: &mut LinearisedCriteria) {
        criteria.fill(self.shape, values, y.len(), |row, weight, sum| models.add_gradient(row, y, weight, sum));
        criteria.scale_objective(self.objective_scale);
    }

    /// Computes the Hessian of the Lagrangian.
    fn lagrangian_hessian(&self, models: &QuadraticModels, multipliers: &Multipliers, hessian: &mut DMatrix<f64>) {
        let sum = multipliers.objectives.len() == 1;
        let (mut objective, mut inequality, mut equality) = (0, 0, 0);
        hessian.fill(0.0);
        for (row, (usage, weight)) in self.shape.rows.iter().enumerate() {
            let weight = match usage {
                Usage::Minimise => {
                    let multiplier = multipliers.objectives[if sum { 0 } else { objective }];
                    objective += 1;
                    self.objective_scale * weight * multiplier
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
            models.add_hessian(row, weight, hessian);
        }
    }

    /// Returns the weight of the violation relative to that of the objective.
    pub fn relative_penalty(&self) -> f64 {
        self.penalty / self.objective_scale
    }

    /// Returns the predicted reduction of a step from some scaled values to others.
    pub fn predicted_reduction(&self, from: &[f64], to: &[f64]) -> PredictedReduction {
        let [before, after] = [from, to].map(|scaled| self.shape.merit(scaled));
        PredictedReduction {
            objective: before.objective - after.objective,
            violation: violation(&before) - violation(&after),
        }
    }

    /// Returns the reduction of the penalised objective that corresponds to a predicted reduction.
    pub fn penalised_reduction(&self, predicted: &PredictedReduction) -> f64 {
        (self.objective_scale * predicted.objective + self.penalty * predicted.violation).max(0.0)
    }
}

/// Solver for the trust-region subproblem; reuses its memory from one step to the next.
#[derive(Default)]
pub struct TrustRegionSubproblem {
    /// Resulting step.
    y: Vec<f64>,
    /// Values of all criteria after the step.
    values: Vec<f64>,
    /// Trial step, and the values after it.
    trial: Vec<f64>,
    trial_values: Vec<f64>,
    /// First step and its values, while others are computed.
    first: [Vec<f64>; 2],
    criteria: LinearisedCriteria,
    trial_criteria: LinearisedCriteria,
    corrected: LinearisedCriteria,
    hessian: DMatrix<f64>,
    factor: Vec<f64>,
    multipliers: Multipliers,
    /// Bounds of the inner step.
    low: Vec<f64>,
    high: Vec<f64>,
    directions: [Direction; 2],
    subproblem: Subproblem,
}

impl TrustRegionSubproblem {
    /// Returns the resulting step.
    pub fn step(&self) -> &[f64] {
        &self.y
    }

    /// Returns the model values after the step.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Minimises the penalised objective of the models over `low <= y <= high`.
    ///
    /// The penalty grows until the violation decreases by most of the decrease that the models permit. Returns false if
    /// no step reduces the objective.
    ///
    /// Source: R. H. Byrd, J. Nocedal, R. A. Waltz, Optimization Methods and Software 23 (2008) 197-213 (steering).
    pub fn solve(
        &mut self,
        objective: &mut PenalisedObjective,
        models: &QuadraticModels,
        low: &[f64],
        high: &[f64],
    ) -> bool {
        let mut found = self.minimise(objective, models, low, high);
        let mut remaining = self.violation(objective.shape);
        if remaining == 0.0 {
            return found;
        }
        self.swap_with_first();
        self.minimise(&PenalisedObjective { penalty: LARGEST_PENALTY, ..*objective }, models, low, high);
        let smallest = self.violation(objective.shape);
        let before = violation(&objective.shape.merit(models.constants()));
        let target = smallest + 0.1 * (before - smallest).max(0.0);
        if remaining <= target || objective.penalty >= LARGEST_PENALTY {
            self.swap_with_first();
            return found;
        }
        while remaining > target && objective.penalty < LARGEST_PENALTY {
            objective.penalty *= 10.0;
            found = self.minimise(objective, models, low, high);
            remaining = self.violation(objective.shape);
        }
        found
    }

    fn swap_with_first(&mut self) {
        std::mem::swap(&mut self.y, &mut self.first[0]);
        std::mem::swap(&mut self.values, &mut self.first[1]);
    }

    /// Returns the violation of the models after the step.
    fn violation(&self, shape: &Shape) -> f64 {
        violation(&shape.merit(&self.values))
    }

    /// Minimises for a fixed penalty, from `y = 0`, by sequential quadratic programming on the models with an inner
    /// trust region and second-order corrections.
    fn minimise(
        &mut self,
        objective: &PenalisedObjective,
        models: &QuadraticModels,
        low: &[f64],
        high: &[f64],
    ) -> bool {
        let n = low.len();
        let Self { y, values, trial, trial_values, criteria, trial_criteria, corrected, hessian, factor, .. } = self;
        let Self { multipliers, low: inner_low, high: inner_high, subproblem, .. } = self;
        let [direction, correction] = &mut self.directions;
        if hessian.nrows() != n {
            *hessian = DMatrix::zeros(n, n);
        }
        y.clear();
        y.resize(n, 0.0);
        values.clear();
        values.extend_from_slice(models.constants());
        let initial_value = objective.value(values);
        let mut value = initial_value;
        objective.linearise(models, y, values, criteria);
        initial_multipliers(criteria, multipliers);
        let (mut radius, mut failures) = (1.0_f64, 0);
        for _ in 0..INNER_ITERATIONS {
            objective.lagrangian_hessian(models, multipliers, hessian);
            make_convex(hessian, factor);
            inner_low.clear();
            inner_low.extend(low.iter().zip(&*y).map(|(low, y)| (low - y).clamp(-radius, 0.0)));
            inner_high.clear();
            inner_high.extend(high.iter().zip(&*y).map(|(high, y)| (high - y).clamp(0.0, radius)));
            let mut try_step = |y: &[f64], step: &[f64], values: &mut Vec<f64>| {
                trial.clear();
                trial.extend(y.iter().zip(step).map(|(y, d)| y + d));
                models.values(trial, values);
                objective.value(values)
            };
            if subproblem.solve(criteria, hessian, [inner_low, inner_high], objective.penalty, direction).is_none() {
                break;
            }
            let length = direction.step.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
            if length == 0.0 {
                break;
            }
            let mut found = try_step(y, &direction.step, trial_values);
            if found >= value {
                trial_criteria.evaluate(objective.shape, trial_values);
                trial_criteria.scale_objective(objective.objective_scale);
                corrected.assign_second_order_correction(criteria, trial_criteria, &direction.step);
                if subproblem
                    .solve(corrected, hessian, [inner_low, inner_high], objective.penalty, correction)
                    .is_some()
                {
                    found = try_step(y, &correction.step, trial_values);
                }
            }
            // The multipliers of a rejected step still improve the Hessian.
            std::mem::swap(multipliers, &mut direction.multipliers);
            if found >= value {
                failures += 1;
                radius = 0.3 * length.min(radius);
                if failures > INNER_FAILURES {
                    break;
                }
                continue;
            }
            let decrease = value - found;
            value = found;
            std::mem::swap(y, trial);
            std::mem::swap(values, trial_values);
            if decrease < 1e-3 * (initial_value - value) {
                break;
            }
            radius = 2.0 * length.max(radius);
            objective.linearise(models, y, values, criteria);
        }
        value < initial_value
    }
}

/// Maximum penalty of the violation.
const LARGEST_PENALTY: f64 = 1e7;

/// Maximum number of inner quadratic programs per subproblem.
const INNER_ITERATIONS: usize = 30;

/// Maximum number of rejected inner steps.
const INNER_FAILURES: usize = 8;

/// Distributes the initial multipliers over the largest objectives.
fn initial_multipliers(criteria: &LinearisedCriteria, multipliers: &mut Multipliers) {
    let maximum = criteria.objective();
    let count = criteria.objectives.iter().filter(|row| row.value >= maximum).count();
    #[allow(clippy::cast_precision_loss)]
    let share = 1.0 / count.max(1) as f64;
    multipliers.objectives.clear();
    multipliers.objectives.extend(criteria.objectives.iter().map(|row| if row.value >= maximum { share } else { 0.0 }));
    multipliers.inequalities.clear();
    multipliers.inequalities.resize(criteria.inequalities.len(), 0.0);
    multipliers.equalities.clear();
    multipliers.equalities.resize(criteria.equalities.len(), 0.0);
}

/// First multiple of the identity added to a matrix that is not positive definite, relative to its norm.
const FIRST_SHIFT: f64 = 1e-3;

/// Lower bound of the smallest eigenvalue, relative to the largest entry.
const MIN_EIGENVALUE: f64 = 1e-8;

/// Makes a symmetric matrix positive definite by adding a multiple of the identity, if necessary. A zero or non-finite
/// matrix is replaced by a small multiple of the identity.
///
/// Source: J. Nocedal, S. Wright, Numerical Optimization, 2nd edition (2006), algorithm 3.3.
///
/// N.B.: in the book, the first multiple is an absolute number, and the smallest eigenvalue has no lower bound. Here a
/// positive semidefinite matrix receives just that bound: with few points, directions without curvature are common.
fn make_convex(matrix: &mut DMatrix<f64>, factor: &mut Vec<f64>) {
    let n = matrix.nrows();
    let size = matrix.iter().fold(0.0_f64, |most, h| if h.is_finite() { most.max(h.abs()) } else { f64::INFINITY });
    if !(size.is_finite() && size > 0.0) {
        matrix.fill_with_identity();
        *matrix *= 1e-9;
        return;
    }
    // In units of the largest entry to avoid overflow: no eigenvalue is below -n.
    let smallest = (0..n).map(|i| matrix[(i, i)]).fold(f64::INFINITY, f64::min) / size;
    let first = FIRST_SHIFT * matrix.iter().map(|h| math::powi(h / size, 2)).sum::<f64>().sqrt();
    let mut shift = if smallest > -MIN_EIGENVALUE { 0.0 } else { first - smallest };
    loop {
        factor.clear();
        factor.extend(matrix.iter().map(|h| h / size));
        (0..n).for_each(|i| factor[i * n + i] += shift - MIN_EIGENVALUE);
        if factorise(factor, n, n) {
            (0..n).for_each(|i| matrix[(i, i)] += shift * size);
            return;
        }
        shift = if shift == 0.0 { 2.0 * MIN_EIGENVALUE } else { first.max(2.0 * shift) };
    }
}

#[cfg(test)]
mod tests {
    use super::super::quadratic_models::tests::through;
    use super::*;

    #[test]
    fn the_kink_of_two_parabolas_is_found() {
        // y^2 and (y - 1)^2 intersect at 1/2.
        let models = through(&[[0.0], [1.0], [-1.0]], |y| vec![y[0] * y[0], math::powi(y[0] - 1.0, 2)]);
        let shape = Shape { spacing: vec![0.0], rows: vec![(Usage::Minimise, 1.0); 2], ..Shape::default() };
        let mut objective = PenalisedObjective { shape: &shape, objective_scale: 1.0, penalty: 10.0 };
        let mut subproblem = TrustRegionSubproblem::default();
        assert!(subproblem.solve(&mut objective, &models, &[-1.0], &[1.0]));
        let predicted_reduction =
            objective.penalised_reduction(&objective.predicted_reduction(models.constants(), subproblem.values()));
        assert!(
            (subproblem.step()[0] - 0.5).abs() < 1e-3 && (predicted_reduction - 0.75).abs() < 1e-3,
            "{:?} {predicted_reduction}",
            subproblem.step()
        );
    }

    #[test]
    fn a_step_goes_along_a_curved_constraint() {
        // -y_1 inside the circle y'y <= 1, from its boundary at (0, 1): the tangent leaves the circle at once.
        let f = |y: &[f64]| vec![-y[0], y[0] * y[0] + y[1] * y[1]];
        let steps = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [0.7, 0.6]];
        let models = through(&steps, |y| f(&[y[0], y[1] + 1.0]));
        let usages = vec![(Usage::Minimise, 1.0), (Usage::Inequality, 1.0)];
        let shape = Shape { spacing: vec![0.0; 2], rows: usages, ..Shape::default() };
        let mut objective = PenalisedObjective { shape: &shape, objective_scale: 1.0, penalty: 10.0 };
        let mut subproblem = TrustRegionSubproblem::default();
        assert!(subproblem.solve(&mut objective, &models, &[-1.0; 2], &[1.0; 2]));
        let y = subproblem.step();
        assert!(y[0] > 0.15 && f(&[y[0], y[1] + 1.0])[1] < 1.0 + 1e-3, "{y:?}");
    }

    #[test]
    fn a_matrix_becomes_convex_by_a_multiple_of_the_identity() {
        let mut factor = Vec::new();
        let convex = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
        let mut matrix = convex.clone();
        make_convex(&mut matrix, &mut factor);
        assert_eq!(matrix, convex);
        // Eigenvalues 3 and -1: the shift must be at least 1 and is at most twice as large.
        let indefinite = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]);
        for size in [1.0, 1e-300, 1e300] {
            let mut matrix = &indefinite * size;
            make_convex(&mut matrix, &mut factor);
            let shift = matrix / size - &indefinite;
            assert!(shift[(0, 0)] > 1.0 && shift[(0, 0)] <= 2.1, "{shift}");
            assert!((&shift - DMatrix::identity(2, 2) * shift[(0, 0)]).amax() < 1e-12);
        }
        let mut flat = DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 0.0, 0.0]);
        make_convex(&mut flat, &mut factor);
        assert!(flat[(1, 1)] > 1e-8 && flat[(1, 1)] < 1e-7, "{flat}");
        let mut matrix = DMatrix::from_element(2, 2, f64::NAN);
        make_convex(&mut matrix, &mut factor);
        assert_eq!(matrix, DMatrix::identity(2, 2) * 1e-9);
    }
}
