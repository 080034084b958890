//! Directions along which no objective increases.

use mops_core::{FEASIBLE, Linearisation, Objective, SMALL_OBJECTIVE, Shape};

use super::{IMPROVEMENT, MAX_CUT_VALUE, Model, NEGLIGIBLE, Step, TRIAL_STEP, steepest_step};
use crate::active_set::dot;
use crate::linearised_criteria::{LinearModel, LinearisedCriteria};

/// Relative derivative below which finite differences show only noise.
const MIN_GRADIENT: f64 = 1e-5;

/// Cone of directions along which no cut of any objective increases. An objective is the largest of its rows.
pub(super) struct DescentCone {
    /// Objective of every minimised row.
    objective_of: Vec<usize>,
    /// Values of the objectives at the point.
    values: Vec<f64>,
    /// Largest derivative of the rows that attain an objective within a trial step; `None` if the objective has no slope.
    steepest: Vec<Option<f64>>,
    /// Rows, and cuts beyond kinks, each with its objective, relative to the objective and in units of its largest derivative.
    cuts: Vec<(usize, LinearModel)>,
    /// Active or nearly active constraints.
    inequalities: Vec<LinearModel>,
    equalities: Vec<LinearModel>,
}

impl DescentCone {
    /// Creates the cone; `None` if no objective has a slope.
    pub fn new(shape: &Shape, at: &Linearisation) -> Option<Self> {
        let criteria = each(shape, at);
        let objective_of = shape.objective_of_rows();
        let values = shape.objectives(at.at.scaled.as_ref()?);
        let mut steepest = vec![None; values.len()];
        for (row, &k) in criteria.objectives.iter().zip(&objective_of) {
            let slope = row.steepest();
            let has_slope = slope >= MIN_GRADIENT * row.value.abs().max(f64::MIN_POSITIVE);
            if has_slope && row.value + slope * TRIAL_STEP >= values[k] {
                steepest[k] = Some(slope.max(steepest[k].unwrap_or(0.0)));
            }
        }
        if steepest.iter().all(Option::is_none) {
            return None;
        }
        let at_zero = |row: &LinearModel| LinearModel { value: 0.0, gradient: row.gradient.clone() };
        let mut cone = Self {
            objective_of,
            values,
            steepest,
            cuts: Vec::new(),
            inequalities: criteria.inequalities.iter().filter(|row| row.value > -1e-4).map(at_zero).collect(),
            equalities: criteria.equalities.iter().map(at_zero).collect(),
        };
        cone.cuts =
            criteria.objectives.iter().enumerate().filter_map(|(row, model)| cone.relative(row, model)).collect();
        Some(cone)
    }

    /// Returns true if every objective has a slope: without one, the first order says nothing of it.
    pub fn is_whole(&self) -> bool {
        self.steepest.iter().all(Option::is_some)
    }

    /// Returns the trade-off weights of the objectives.
    pub fn trade_offs(&self, point: &[f64]) -> Option<Vec<f64>> {
        self.solve(point).map(|(_, weights)| weights)
    }

    /// Returns the linear model of a row relative to its objective, in units of the largest derivative of the objective; `None`
    /// if the objective has no slope.
    fn relative(&self, row: usize, model: &LinearModel) -> Option<(usize, LinearModel)> {
        let k = self.objective_of[row];
        let steepest = self.steepest[k]?;
        let gradient = model.gradient.iter().map(|slope| slope / steepest).collect();
        Some((k, LinearModel { value: (model.value - self.values[k]) / steepest, gradient }))
    }

    /// Computes the step with the steepest descent in the cone, with the trade-off weights of the objectives.
    ///
    /// The unknowns are the step and the change `t_k <= 0` of every objective; the sum of the changes is minimised.
    fn solve(&self, point: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        let (n, m) = (point.len(), self.values.len());
        // Lengths in units of the step: values and gradients are then of the same order.
        let extended = |row: &LinearModel, scale: f64, change: Option<usize>| {
            let mut gradient = row.gradient.clone();
            gradient.resize(n + m, 0.0);
            if let Some(k) = change {
                gradient[n + k] = -1.0;
            }
            LinearModel { value: row.value / scale, gradient }
        };
        let mut inequalities: Vec<LinearModel> =
            self.cuts.iter().map(|(k, cut)| extended(cut, TRIAL_STEP, Some(*k))).collect();
        inequalities.extend(self.inequalities.iter().map(|row| extended(row, TRIAL_STEP, None)));
        let equalities = self.equalities.iter().map(|row| extended(row, 1.0, None)).collect();
        let mut gradient = vec![0.0; n];
        gradient.extend(self.steepest.iter().map(|steepest| if steepest.is_some() { 1.0 } else { 0.0 }));
        let total = LinearModel { value: 0.0, gradient };
        let cone = LinearisedCriteria { objectives: vec![total], inequalities, equalities };
        let direction = steepest_step(&cone, point, m)?;
        // The change of an objective balances the multipliers of its cuts.
        let mut weights = vec![0.0; m];
        for ((k, _), multiplier) in self.cuts.iter().zip(&direction.multipliers.inequalities) {
            weights[*k] += multiplier;
        }
        for (weight, steepest) in weights.iter_mut().zip(&self.steepest) {
            *weight /= steepest.unwrap_or(f64::INFINITY);
        }
        Some((direction.step[..n].to_vec(), weights))
    }

    /// Returns true if a decrease of an objective is more than [`NEGLIGIBLE`].
    fn is_considerable(&self, objective: usize, decrease: f64) -> bool {
        decrease > NEGLIGIBLE * (self.values[objective].abs() + SMALL_OBJECTIVE)
    }

    /// Returns the decrease of an objective along a step in units of the trial step, according to all of its cuts.
    fn decrease(&self, objective: usize, step: &[f64]) -> f64 {
        let cuts = self.cuts.iter().filter(|(k, _)| *k == objective);
        cuts.map(|(_, cut)| -(cut.value / TRIAL_STEP + dot(&cut.gradient, step))).fold(f64::INFINITY, f64::min)
    }
}

impl Model for DescentCone {
    fn direction(&self, point: &[f64]) -> Option<Step> {
        let (step, _) = self.solve(point)?;
        let with_slope = (0..self.values.len()).filter(|&k| self.steepest[k].is_some());
        let predicted: Vec<(usize, f64)> = with_slope.map(|k| (k, self.decrease(k, &step))).collect();
        let total: f64 = predicted.iter().map(|(_, decrease)| decrease).sum();
        let counts = |(k, decrease): &(usize, f64)| {
            self.steepest[*k].is_some_and(|unit| self.is_considerable(*k, decrease * unit * TRIAL_STEP))
        };
        let is_negligible = total <= IMPROVEMENT || !predicted.iter().any(counts);
        Some(Step { step: step.iter().map(|d| TRIAL_STEP * d).collect(), is_negligible })
    }

    /// No objective is worse, at least one is considerably better, and all constraints are satisfied.
    fn is_improvement(&self, shape: &Shape, trial: &[f64]) -> bool {
        let after = shape.objectives(trial);
        let none_worse = self.values.iter().zip(&after).all(|(b, a)| a <= b);
        let feasible = shape.inequalities(trial).iter().all(|c| *c <= FEASIBLE)
            && shape.equalities(trial).iter().all(|c| c.abs() <= FEASIBLE);
        let one_better = self.values.iter().zip(&after).enumerate().any(|(k, (b, a))| self.is_considerable(k, b - a));
        none_worse && feasible && one_better
    }

    /// Models above the value at the point are lowered to it.
    fn add(&mut self, shape: &Shape, point: &[f64], beyond: &Linearisation) -> bool {
        let criteria = each(shape, beyond);
        let offset: Vec<f64> = point.iter().zip(&beyond.at.point).map(|(a, b)| a - b).collect();
        let extended = |row: &LinearModel| row.value + dot(&row.gradient, &offset);
        let mut jumps = false;
        for (row, model) in criteria.objectives.iter().enumerate() {
            let Some((k, cut)) = self.relative(row, model) else { continue };
            let value = extended(&cut);
            if value > MAX_CUT_VALUE * TRIAL_STEP {
                jumps = true;
            } else {
                self.cuts.push((k, LinearModel { value: value.min(0.0), gradient: cut.gradient }));
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
