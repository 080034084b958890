//! Level of the objective around a point.

use mops_core::{
    Shape,
    solver::{Linearisation, SMALL_OBJECTIVE},
};

use super::model::{CURVATURE, MAX_CUT_VALUE, Model, NEGLIGIBLE, Step, TRIAL_STEP, steepest_step};
use crate::active_set::dot;
use crate::linearised_criteria::{LinearModel, LinearisedCriteria};

/// Change of the objective within a trial step that is a rounding error, relative as above.
const ROUNDING: f64 = 1e-11;

/// Cutting-plane model of the objective (at an infeasible point: of the largest violation).
pub(super) struct Level {
    /// True if the point is feasible.
    is_feasible: bool,
    /// Objective at the point.
    value: f64,
    /// Largest derivative of the functions that attain the objective.
    steepest: f64,
    /// Linear models of the functions at the point.
    at: LinearisedCriteria,
    /// Linear models of the same functions at other points, extrapolated to the point.
    cuts: LinearisedCriteria,
}

impl Level {
    pub fn new(shape: &Shape, linearisation: &Linearisation) -> Self {
        let is_feasible = linearisation.at.merit.is_feasible();
        let at = functions(shape, linearisation, is_feasible);
        let value = at.objective();
        let attains = |row: &&LinearModel| row.value >= value - NEGLIGIBLE * (value.abs() + SMALL_OBJECTIVE);
        let steepest = at.objectives.iter().filter(attains).map(LinearModel::steepest).fold(0.0, f64::max);
        Self { is_feasible, value, steepest, at, cuts: LinearisedCriteria::default() }
    }

    /// Returns true if the objective has no slope at the point.
    pub fn is_flat(&self) -> bool {
        self.steepest * TRIAL_STEP <= ROUNDING * self.size()
    }

    /// Returns true if the objective of scaled values is that at the point, except for rounding errors.
    pub fn is_equal(&self, shape: &Shape, values: &[f64]) -> bool {
        (self.objective(shape, values) - self.value).abs() <= ROUNDING * self.size()
    }

    /// Returns true if the objective of scaled values is that at the point, to the last bit.
    pub fn is_identical(&self, shape: &Shape, values: &[f64]) -> bool {
        self.objective(shape, values).to_bits() == self.value.to_bits()
    }

    fn size(&self) -> f64 {
        self.value.abs() + SMALL_OBJECTIVE
    }

    /// Returns the objective of scaled values; infinite if they become infeasible.
    fn objective(&self, shape: &Shape, values: &[f64]) -> f64 {
        let merit = shape.merit(values);
        match (self.is_feasible, merit.is_feasible()) {
            (false, _) => merit.violation,
            (true, true) => merit.objective,
            (true, false) => f64::INFINITY,
        }
    }
}

impl Model for Level {
    fn direction(&self, point: &[f64], goes_on: &dyn Fn() -> bool) -> Option<Step> {
        let n = point.len();
        let unit = self.steepest.max(f64::MIN_POSITIVE);
        #[allow(clippy::cast_precision_loss)]
        let lowest = self.value - unit * n as f64 * TRIAL_STEP;
        // In units of the trial step and of a derivative.
        let scaled = |row: &LinearModel, value: f64, unit: f64| LinearModel {
            value: value / (unit * TRIAL_STEP),
            gradient: row.gradient.iter().map(|slope| slope / unit).collect(),
        };
        let reaches = |row: &LinearModel, limit: f64| {
            row.value + row.gradient.iter().map(|slope| slope.abs()).sum::<f64>() * TRIAL_STEP >= limit
        };
        let all = |group: fn(&LinearisedCriteria) -> &Vec<LinearModel>| group(&self.at).iter().chain(group(&self.cuts));
        let objectives = all(|c| &c.objectives).filter(|row| reaches(row, lowest));
        let inequalities = all(|c| &c.inequalities).filter(|row| reaches(row, 0.0));
        let criteria = LinearisedCriteria {
            objectives: objectives.map(|row| scaled(row, row.value - self.value, unit)).collect(),
            // Constraints hold at the point.
            inequalities: inequalities
                .map(|row| scaled(row, row.value.min(0.0), row.steepest().max(f64::MIN_POSITIVE)))
                .collect(),
            equalities: self.at.equalities.iter().map(|row| scaled(row, 0.0, unit)).collect(),
        };
        let direction = steepest_step(&criteria, point, (0, CURVATURE), goes_on)?;
        let predicted = -direction.level * unit * TRIAL_STEP;
        Some(Step {
            step: direction.step.iter().map(|d| TRIAL_STEP * d).collect(),
            is_negligible: predicted <= NEGLIGIBLE * self.size(),
        })
    }

    fn is_improvement(&self, shape: &Shape, trial: &[f64]) -> bool {
        self.objective(shape, trial) < self.value - NEGLIGIBLE * self.size()
    }

    fn add(&mut self, shape: &Shape, point: &[f64], beyond: &Linearisation) -> bool {
        let offset: Vec<f64> = point.iter().zip(&beyond.at.point).map(|(a, b)| a - b).collect();
        let LinearisedCriteria { objectives, inequalities, .. } = functions(shape, beyond, self.is_feasible);
        let mut jumps = false;
        // `limit` is the value above which a function matters.
        let mut extend = |rows: Vec<LinearModel>, at: &[LinearModel], limit: f64, into: &mut Vec<LinearModel>| {
            for (row, at) in rows.into_iter().zip(at) {
                let value = row.value + dot(&row.gradient, &offset);
                let steepest = row.steepest();
                if value > at.value.max(limit) + MAX_CUT_VALUE * steepest * TRIAL_STEP {
                    jumps = true;
                } else {
                    into.push(LinearModel { value: value.min(at.value), gradient: row.gradient });
                }
            }
        };
        extend(objectives, &self.at.objectives, self.value, &mut self.cuts.objectives);
        extend(inequalities, &self.at.inequalities, 0.0, &mut self.cuts.inequalities);
        jumps
    }
}

/// Returns the functions whose maximum is the objective, with the constraints; for an infeasible point, the constraints
/// whose maximum is the violation.
fn functions(shape: &Shape, at: &Linearisation, is_feasible: bool) -> LinearisedCriteria {
    let criteria = LinearisedCriteria::from_linearisation(shape, at);
    if is_feasible {
        return criteria;
    }
    let negative = |row: &LinearModel| LinearModel {
        value: -row.value,
        gradient: row.gradient.iter().map(|slope| -slope).collect(),
    };
    let mirrored: Vec<LinearModel> = criteria.equalities.iter().map(negative).collect();
    let objectives = criteria.inequalities.into_iter().chain(criteria.equalities).chain(mirrored).collect();
    LinearisedCriteria { objectives, ..LinearisedCriteria::default() }
}
