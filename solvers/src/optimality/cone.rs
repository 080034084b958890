//! Directions along which no criterion increases.

use mops_core::{FEASIBLE, Linearisation, Objective, Shape};

use super::{IMPROVEMENT, MAX_CUT_VALUE, Model, Step, TRIAL_STEP, steepest_step};
use crate::active_set::dot;
use crate::linearised_criteria::{LinearModel, LinearisedCriteria};

/// Relative derivative below which finite differences show only noise.
const MIN_GRADIENT: f64 = 1e-5;

/// Cone of directions along which no cut of any criterion increases.
pub(super) struct DescentCone {
    /// Criteria to be minimised that have a slope, relative to their value at the point, in units of their largest derivative.
    objectives: Vec<LinearModel>,
    /// Cuts beyond kinks, each with the index of its criterion.
    cuts: Vec<(usize, LinearModel)>,
    /// Active or nearly active constraints.
    inequalities: Vec<LinearModel>,
    equalities: Vec<LinearModel>,
    /// Weighted scaled values at the point.
    values: Vec<f64>,
    /// Index, value and largest derivative of every criterion that has a slope.
    scales: Vec<(usize, f64, f64)>,
}

impl DescentCone {
    /// Creates the cone; `None` if no criterion has a slope.
    pub fn new(shape: &Shape, at: &Linearisation) -> Option<Self> {
        let criteria = each(shape, at);
        let has_slope = |(k, row): (usize, &LinearModel)| {
            let (value, steepest) = (row.value, row.steepest());
            (steepest >= MIN_GRADIENT * value.abs().max(f64::MIN_POSITIVE)).then_some((k, value, steepest))
        };
        let scales: Vec<(usize, f64, f64)> = criteria.objectives.iter().enumerate().filter_map(has_slope).collect();
        let at_zero = |row: &LinearModel| LinearModel { value: 0.0, gradient: row.gradient.clone() };
        (!scales.is_empty()).then(|| Self {
            objectives: scales.iter().map(|scale| normalised(&criteria.objectives[scale.0], *scale)).collect(),
            cuts: Vec::new(),
            inequalities: criteria.inequalities.iter().filter(|row| row.value > -1e-4).map(at_zero).collect(),
            equalities: criteria.equalities.iter().map(at_zero).collect(),
            values: criteria.objectives.iter().map(|row| row.value).collect(),
            scales,
        })
    }

    /// Returns true if every criterion has a slope: without one, the first order says nothing of it.
    pub fn is_whole(&self) -> bool {
        self.scales.len() == self.values.len()
    }

    /// Returns the trade-off weights of the criteria.
    pub fn trade_offs(&self, point: &[f64]) -> Option<Vec<f64>> {
        self.solve(point).map(|(_, weights)| weights)
    }

    /// Computes the step with the steepest descent in the cone, with the trade-off weights of the criteria.
    fn solve(&self, point: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        // Lengths in units of the step: values and gradients are then of the same order.
        let in_step_units =
            |row: &LinearModel| LinearModel { value: row.value / TRIAL_STEP, gradient: row.gradient.clone() };
        let mut inequalities: Vec<LinearModel> = self.objectives.iter().map(in_step_units).collect();
        inequalities.extend(self.cuts.iter().map(|(_, cut)| in_step_units(cut)));
        inequalities.extend(self.inequalities.iter().map(in_step_units));
        let sum =
            |gradient: Vec<f64>, row: &LinearModel| gradient.iter().zip(&row.gradient).map(|(a, b)| a + b).collect();
        let total = LinearModel { value: 0.0, gradient: self.objectives.iter().fold(vec![0.0; point.len()], sum) };
        let cone = LinearisedCriteria { objectives: vec![total], inequalities, equalities: self.equalities.clone() };
        let direction = steepest_step(&cone, point)?;
        // The weights are those of the sum plus the multipliers that keep each criterion from increasing.
        let constraint_multipliers = &direction.multipliers.inequalities;
        let m = self.objectives.len();
        let mut weights: Vec<f64> = constraint_multipliers[..m].iter().map(|multiplier| 1.0 + multiplier).collect();
        for ((k, _), multiplier) in self.cuts.iter().zip(&constraint_multipliers[m..]) {
            weights[*k] += multiplier;
        }
        weights.iter_mut().zip(&self.scales).for_each(|(weight, (_, _, steepest))| *weight /= steepest);
        Some((direction.step, weights))
    }

    /// Returns the decrease of a criterion along a step, according to all of its cuts.
    fn decrease(&self, row: usize, step: &[f64]) -> f64 {
        let linear_decrease = -dot(&self.objectives[row].gradient, step);
        let cuts = self.cuts.iter().filter(|(k, _)| *k == row);
        cuts.map(|(_, cut)| -(cut.value / TRIAL_STEP + dot(&cut.gradient, step))).fold(linear_decrease, f64::min)
    }
}

impl Model for DescentCone {
    fn direction(&self, point: &[f64]) -> Option<Step> {
        let (step, _) = self.solve(point)?;
        let predicted: f64 = (0..self.objectives.len()).map(|k| self.decrease(k, &step)).sum();
        Some(Step { step: step.iter().map(|d| TRIAL_STEP * d).collect(), is_negligible: predicted <= IMPROVEMENT })
    }

    /// No criterion is worse, at least one is better, and all constraints are satisfied.
    fn is_improvement(&self, shape: &Shape, trial: &[f64]) -> bool {
        let after = shape.objectives(trial);
        let none_worse = self.values.iter().zip(&after).all(|(b, a)| a <= b);
        let feasible = shape.inequalities(trial).iter().all(|c| *c <= FEASIBLE)
            && shape.equalities(trial).iter().all(|c| c.abs() <= FEASIBLE);
        none_worse && feasible && self.values != after
    }

    /// Models above the value at the point are lowered to it.
    fn add(&mut self, shape: &Shape, point: &[f64], beyond: &Linearisation) -> bool {
        let criteria = each(shape, beyond);
        let offset: Vec<f64> = point.iter().zip(&beyond.at.point).map(|(a, b)| a - b).collect();
        let extended = |row: &LinearModel| row.value + dot(&row.gradient, &offset);
        let mut jumps = false;
        for (k, scale) in self.scales.iter().enumerate() {
            let row = normalised(&criteria.objectives[scale.0], *scale);
            let value = extended(&row);
            if value > MAX_CUT_VALUE * TRIAL_STEP {
                jumps = true;
            } else {
                self.cuts.push((k, LinearModel { value: value.min(0.0), gradient: row.gradient }));
            }
        }
        for row in criteria.inequalities {
            let value = extended(&row);
            if value > -1e-4 {
                self.inequalities.push(LinearModel { value: value.min(0.0), gradient: row.gradient });
            }
        }
        jumps
    }
}

/// Returns the criteria, where each counts on its own, even if the objective is the sum.
fn each(shape: &Shape, at: &Linearisation) -> LinearisedCriteria {
    LinearisedCriteria::from_linearisation(&Shape { objective: Objective::Max, ..shape.clone() }, at)
}

/// Returns the linear model relative to `value`, in units of the largest derivative `steepest`.
fn normalised(row: &LinearModel, (_, value, steepest): (usize, f64, f64)) -> LinearModel {
    LinearModel { value: (row.value - value) / steepest, gradient: row.gradient.iter().map(|s| s / steepest).collect() }
}
