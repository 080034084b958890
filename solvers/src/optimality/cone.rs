//! Directions along which no objective increases.

use mops_core::{
    Objective, Shape,
    evaluation::FEASIBLE,
    solver::{Linearisation, SMALL_OBJECTIVE},
};

use super::model::{CURVATURE, IMPROVEMENT, MAX_CUT_VALUE, Model, NEGLIGIBLE, Step, TRIAL_STEP, steepest_step};
use crate::active_set::dot;
use crate::linearised_criteria::{LinearModel, LinearisedCriteria};

/// Relative derivative below which finite differences show only noise.
const MIN_GRADIENT: f64 = 1e-5;

/// Largest number of unknowns for changes of objectives. The work of a step of the quadratic program grows with its
/// square.
const GROUPS: usize = 32;

/// Largest number of quadratic programs with cutting planes for one direction.
const MOST_PLANES: usize = 50;

/// Difference of the sum of the changes from its bound by cutting planes that is negligible, relative to the change and
/// to
/// [`IMPROVEMENT`].
const GAP: f64 = 0.1;

/// Cone of directions along which no cut of any objective increases. An objective is the largest of its rows.
pub(super) struct DescentCone {
    /// Objective of every minimised row.
    objective_of: Vec<usize>,
    /// Values of the objectives at the point.
    values: Vec<f64>,
    /// Largest derivative of the rows that attain an objective within a trial step; `None` if the objective has no
    /// slope.
    steepest: Vec<Option<f64>>,
    /// Rows, and cuts beyond kinks, each with its objective, relative to the objective and in units of its largest
    /// derivative.
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
    pub fn trade_offs(&self, point: &[f64], goes_on: &dyn Fn() -> bool) -> Option<Vec<f64>> {
        self.solve(point, goes_on).map(|(_, weights)| weights)
    }

    /// Returns the linear model of a row relative to its objective, in units of the largest derivative of the
    /// objective; `None` if the objective has no slope.
    fn relative(&self, row: usize, model: &LinearModel) -> Option<(usize, LinearModel)> {
        let k = self.objective_of[row];
        let steepest = self.steepest[k]?;
        let gradient = model.gradient.iter().map(|slope| slope / steepest).collect();
        Some((k, LinearModel { value: (model.value - self.values[k]) / steepest, gradient }))
    }

    /// Computes the step with the steepest descent in the cone, with the trade-off weights of the objectives.
    ///
    /// The unknowns are the step and the changes `t_k <= 0` of the objectives; the sum of the changes is minimised.
    ///
    /// More than [`GROUPS`] objectives are divided into groups of `s`. The unknown of a group is the mean change of its
    /// objectives, bounded below by cutting planes: the mean of the linear models that are largest at an earlier step.
    /// So the size of the quadratic program does not depend on the number of objectives. Source: C. Lemarechal, Y.
    /// Nesterov, Mathematical Programming 69 (1995) 111-147, for sums of functions.
    #[allow(clippy::cast_precision_loss)]
    fn solve(&self, point: &[f64], goes_on: &dyn Fn() -> bool) -> Option<(Vec<f64>, Vec<f64>)> {
        let (n, m) = (point.len(), self.values.len());
        let size = m.div_ceil(GROUPS);
        let groups = m.div_ceil(size);
        // Lengths in units of the step: values and gradients are then of the same order.
        let extended = |row: &LinearModel, scale: f64, change: Option<usize>| {
            let mut gradient = row.gradient.clone();
            gradient.resize(n + groups, 0.0);
            if let Some(k) = change {
                gradient[n + k] = -1.0;
            }
            LinearModel { value: row.value / scale, gradient }
        };
        // The objectives of a group must not increase; an objective alone has its change.
        let change = |k: usize| (size == 1).then_some(k);
        let mut inequalities: Vec<LinearModel> =
            self.cuts.iter().map(|(k, cut)| extended(cut, TRIAL_STEP, change(*k))).collect();
        inequalities.extend(self.inequalities.iter().map(|row| extended(row, TRIAL_STEP, None)));
        let alone = inequalities.len();
        let equalities = self.equalities.iter().map(|row| extended(row, 1.0, None)).collect();
        let mut gradient = vec![0.0; n];
        let has_slope = |group: &[Option<f64>]| group.iter().any(Option::is_some);
        gradient.extend(self.steepest.chunks(size).map(|group| if has_slope(group) { 1.0 } else { 0.0 }));
        let total = LinearModel { value: 0.0, gradient };
        let mut cone = LinearisedCriteria { objectives: vec![total], inequalities, equalities };
        let mut planes = Vec::new();
        let mut at = vec![0.0; n];
        for _ in 0..MOST_PLANES {
            if size > 1 {
                let (bounds, added) = (self.means(&at, size), planes.len());
                planes.extend(0..bounds.len());
                cone.inequalities.extend(bounds.iter().enumerate().map(|(g, bound)| extended(bound, 1.0, Some(g))));
                debug_assert_eq!(cone.inequalities.len(), alone + added + bounds.len());
            }
            let direction = steepest_step(&cone, point, (groups, CURVATURE / size as f64), goes_on)?;
            at = direction.step[..n].to_vec();
            let change = self.change(&at);
            let expected: f64 = direction.step[n..].iter().sum::<f64>() * size as f64;
            if size > 1 && change - expected > GAP * (IMPROVEMENT + change.abs()) {
                continue;
            }
            return Some((at, self.weights(&direction.multipliers.inequalities, alone, (&planes, size))));
        }
        None
    }

    /// Returns, for every group, the mean of the linear models that are largest at a step, in units of the trial step.
    #[allow(clippy::cast_precision_loss)]
    fn means(&self, at: &[f64], size: usize) -> Vec<LinearModel> {
        let mut means: Vec<LinearModel> =
            self.values.chunks(size).map(|_| LinearModel { value: 0.0, gradient: vec![0.0; at.len()] }).collect();
        for (k, cut) in self.largest(at).iter().enumerate() {
            let Some((_, cut)) = cut else { continue };
            let mean = &mut means[k / size];
            mean.value += cut.value / TRIAL_STEP / size as f64;
            mean.gradient.iter_mut().zip(&cut.gradient).for_each(|(sum, slope)| *sum += slope / size as f64);
        }
        means
    }

    /// Returns the value and the linear model that is largest at a step, in units of the trial step, for every
    /// objective with a slope.
    fn largest(&self, at: &[f64]) -> Vec<Option<(f64, &LinearModel)>> {
        let mut largest: Vec<Option<(f64, &LinearModel)>> = vec![None; self.values.len()];
        for (k, cut) in &self.cuts {
            let value = cut.value / TRIAL_STEP + dot(&cut.gradient, at);
            if largest[*k].is_none_or(|(known, _)| value > known) {
                largest[*k] = Some((value, cut));
            }
        }
        largest
    }

    /// Returns the sum of the changes of all objectives along a step in units of the trial step, according to all cuts.
    fn change(&self, step: &[f64]) -> f64 {
        self.largest(step).iter().flatten().map(|(value, _)| value).sum()
    }

    /// Returns the trade-off weights: the change of an objective, or of the mean of its group, balances the multipliers
    /// of its cuts. The planes stand after the rows of `alone`, each with its group.
    #[allow(clippy::cast_precision_loss)]
    fn weights(&self, multipliers: &[f64], alone: usize, (planes, size): (&[usize], usize)) -> Vec<f64> {
        let mut weights = vec![0.0; self.values.len()];
        for ((k, _), multiplier) in self.cuts.iter().zip(multipliers) {
            weights[*k] += size as f64 * multiplier;
        }
        for (&group, multiplier) in planes.iter().zip(&multipliers[alone..]) {
            weights.chunks_mut(size).nth(group).into_iter().flatten().for_each(|weight| *weight += multiplier);
        }
        for (weight, steepest) in weights.iter_mut().zip(&self.steepest) {
            *weight /= steepest.unwrap_or(f64::INFINITY);
        }
        weights
    }

    /// Returns true if a decrease of an objective is more than [`NEGLIGIBLE`].
    fn is_considerable(&self, objective: usize, decrease: f64) -> bool {
        decrease > NEGLIGIBLE * (self.values[objective].abs() + SMALL_OBJECTIVE)
    }
}

impl Model for DescentCone {
    fn direction(&self, point: &[f64], goes_on: &dyn Fn() -> bool) -> Option<Step> {
        let (step, _) = self.solve(point, goes_on)?;
        let predicted = -self.change(&step);
        let largest = self.largest(&step);
        let is_considerable = largest.iter().enumerate().any(|(k, change)| match (change, self.steepest[k]) {
            (Some((change, _)), Some(unit)) => self.is_considerable(k, -change * unit * TRIAL_STEP),
            _ => false,
        });
        let is_negligible = predicted <= IMPROVEMENT || !is_considerable;
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

#[cfg(test)]
mod tests {
    use mops_core::{Evaluation, Merit, Usage};

    use super::*;

    /// Linearisation at 0.5 of rows `f_k = 1 + g_k (x - 0.5)`.
    fn linearisation(gradients: &[[f64; 2]]) -> (Shape, Linearisation) {
        let count = gradients.len();
        let rows = vec![(Usage::Minimise, 1.0); count];
        let shape = Shape { spacing: vec![0.0; 2], rows, ..Shape::default() };
        let at = Evaluation {
            point: vec![0.5; 2],
            tuners: vec![0.5; 2],
            readings: Vec::new(),
            scaled: Some(vec![1.0; count]),
            residuals: Vec::new(),
            failures: Vec::new(),
            merit: Merit { violation: 0.0, objective: 1.0 },
        };
        (shape, Linearisation { at, rows: gradients.iter().map(|g| g.to_vec()).collect(), residuals: Vec::new() })
    }

    /// Directions of `count` objectives, evenly in the sector of angles from `from` to `to`.
    fn fan(count: usize, [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
        let angle = |k: usize| from + (to - from) * k as f64 / (count - 1) as f64;
        (0..count).map(|k| [mops_math::cos(angle(k)), mops_math::sin(angle(k))]).collect()
    }

    #[test]
    fn many_objectives_descend_together_if_their_gradients_leave_a_half_plane() {
        for count in [2, 32, 33, 500] {
            // All gradients point upwards within 60 degrees of the vertical: to go down lowers all of them.
            let (shape, at) = linearisation(&fan(count, [0.53, 2.61]));
            let cone = DescentCone::new(&shape, &at).unwrap();
            let step = cone.direction(&[0.5; 2], &|| true).unwrap();
            assert!(!step.is_negligible && step.step[1] < 0.0, "{count}: {:?}", step.step);
            assert!(
                cone.largest(&step.step.iter().map(|d| d / TRIAL_STEP).collect::<Vec<_>>())
                    .iter()
                    .flatten()
                    .all(|(value, _)| *value < 1e-6)
            );
        }
    }

    #[test]
    fn weights_of_many_objectives_balance_their_gradients_at_a_certified_point() {
        for count in [3, 32, 33, 500] {
            // The gradients go around: no direction lowers all.
            let gradients = fan(count, [0.0, 6.0]);
            let (shape, at) = linearisation(&gradients);
            let cone = DescentCone::new(&shape, &at).unwrap();
            assert!(cone.direction(&[0.5; 2], &|| true).unwrap().is_negligible, "{count}");
            let weights = cone.trade_offs(&[0.5; 2], &|| true).unwrap();
            assert!(weights.iter().all(|weight| *weight > 0.0), "{count}");
            let total: f64 = weights.iter().sum();
            for i in 0..2 {
                let sum: f64 = weights.iter().zip(&gradients).map(|(weight, g)| weight * g[i]).sum();
                assert!(sum.abs() < 1e-5 * total, "{count}: {sum} of {total}");
            }
        }
    }

    #[test]
    fn a_stop_request_is_seen_between_two_steps_of_the_quadratic_program() {
        let (shape, at) = linearisation(&fan(500, [0.0, 6.0]));
        let cone = DescentCone::new(&shape, &at).unwrap();
        let asked = std::cell::Cell::new(0);
        let stops_at = |last: usize| {
            asked.set(0);
            let found = cone.direction(&[0.5; 2], &|| {
                asked.set(asked.get() + 1);
                asked.get() < last
            });
            (found.is_some(), asked.get())
        };
        let (found, all) = stops_at(usize::MAX);
        assert!(found && all > 10, "{all}");
        for last in [1, 2, all / 2] {
            assert_eq!(stops_at(last), (false, last));
        }
    }
}
