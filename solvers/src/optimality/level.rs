//! Level of the objective around a point.

use mops_core::{Linearisation, Shape};
use nalgebra::DMatrix;

use super::{MAX_CUT_VALUE, Model, Step, TRIAL_STEP, box_of};
use crate::active_set::dot;
use crate::epigraph::{Direction, Subproblem};
use crate::linearised_criteria::{LinearModel, LinearisedCriteria};

/// Decrease of the objective within a trial step that is regarded as zero, relative to the objective plus [`SMALL`].
const NEGLIGIBLE: f64 = 1e-5;

/// Objective that is regarded as zero. A scaled value of 1 is the demand.
const SMALL: f64 = 1e-3;

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
        let attains = |row: &&LinearModel| row.value >= value - NEGLIGIBLE * (value.abs() + SMALL);
        let slopes = at.objectives.iter().filter(attains).flat_map(|row| &row.gradient);
        let steepest = slopes.fold(0.0_f64, |largest, slope| largest.max(slope.abs()));
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

    fn size(&self) -> f64 {
        self.value.abs() + SMALL
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
    fn direction(&self, point: &[f64]) -> Option<Step> {
        let n = point.len();
        let unit = self.steepest.max(f64::MIN_POSITIVE);
        // In units of the trial step and of the largest derivative, relative to the objective.
        let scaled = |row: &LinearModel, base: f64| LinearModel {
            value: (row.value - base) / (unit * TRIAL_STEP),
            gradient: row.gradient.iter().map(|slope| slope / unit).collect(),
        };
        // Whether the function can exceed what the objective may fall to, within the step.
        let reaches = |row: &LinearModel| {
            let reach: f64 = row.gradient.iter().map(|slope| slope.abs()).sum();
            #[allow(clippy::cast_precision_loss)]
            let fall = unit * n as f64;
            row.value + reach * TRIAL_STEP >= self.value - fall * TRIAL_STEP
        };
        let all = |group: fn(&LinearisedCriteria) -> &Vec<LinearModel>| group(&self.at).iter().chain(group(&self.cuts));
        let within = |row: &LinearModel| {
            let reach: f64 = row.gradient.iter().map(|slope| slope.abs()).sum();
            // A constraint holds at the point.
            (row.value + reach * TRIAL_STEP >= 0.0).then(|| {
                let held = LinearModel { value: row.value.min(0.0), gradient: row.gradient.clone() };
                let size = row.gradient.iter().fold(f64::MIN_POSITIVE, |largest, slope| largest.max(slope.abs()));
                LinearModel {
                    value: held.value / (size * TRIAL_STEP),
                    gradient: held.gradient.iter().map(|slope| slope / size).collect(),
                }
            })
        };
        let criteria = LinearisedCriteria {
            objectives: all(|c| &c.objectives).filter(|row| reaches(row)).map(|row| scaled(row, self.value)).collect(),
            inequalities: all(|c| &c.inequalities).filter_map(within).collect(),
            equalities: self.at.equalities.iter().map(|row| scaled(row, row.value)).collect(),
        };
        let [low, high] = box_of(point);
        let mut direction = Direction::default();
        let hessian = DMatrix::identity(n, n) * 1e-6;
        Subproblem::default().solve(&criteria, &hessian, [&low, &high], 1e4, &mut direction)?;
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
                let steepest = row.gradient.iter().fold(0.0_f64, |largest, slope| largest.max(slope.abs()));
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

/// Returns the functions whose maximum is the objective, with the constraints; for an infeasible point, the constraints whose
/// maximum is the violation.
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
