//! Criteria linearised at a point, grouped by usage.

use mops_core::{Objective, Shape, Usage, solver::Linearisation};

use crate::active_set::dot;

/// Value and gradient of a function.
#[derive(Debug, Default)]
pub struct LinearModel {
    /// Value.
    pub value: f64,
    /// Gradient; empty if only the value is known.
    pub gradient: Vec<f64>,
}

impl LinearModel {
    /// Returns the largest derivative.
    pub fn steepest(&self) -> f64 {
        self.gradient.iter().fold(0.0_f64, |largest, slope| largest.max(slope.abs()))
    }
}

// N.B.: a derived `clone_from` allocates new memory.
impl Clone for LinearModel {
    fn clone(&self) -> Self {
        Self { value: self.value, gradient: self.gradient.clone() }
    }

    fn clone_from(&mut self, other: &Self) {
        self.value = other.value;
        self.gradient.clone_from(&other.gradient);
    }
}

/// Criteria of a problem, linearised at a point and grouped by usage. Memory is reused from one point to the next.
#[derive(Debug, Default)]
pub struct LinearisedCriteria {
    /// Functions whose maximum is minimised; a single function, the sum, if the objective is a sum.
    pub objectives: Vec<LinearModel>,
    /// Inequality constraints, satisfied if at most 0.
    pub inequalities: Vec<LinearModel>,
    /// Equality constraints, satisfied if 0.
    pub equalities: Vec<LinearModel>,
}

impl Clone for LinearisedCriteria {
    fn clone(&self) -> Self {
        let mut criteria = Self::default();
        criteria.clone_from(self);
        criteria
    }

    fn clone_from(&mut self, other: &Self) {
        self.objectives.clone_from(&other.objectives);
        self.inequalities.clone_from(&other.inequalities);
        self.equalities.clone_from(&other.equalities);
    }
}

impl LinearisedCriteria {
    /// Creates the criteria of a linearisation.
    pub fn from_linearisation(shape: &Shape, at: &Linearisation) -> Self {
        let mut criteria = Self::default();
        criteria.linearise(shape, at);
        criteria
    }

    /// Creates criteria from scaled values, without gradients.
    pub fn from_values(shape: &Shape, scaled: &[f64]) -> Self {
        let mut criteria = Self::default();
        criteria.evaluate(shape, scaled);
        criteria
    }

    /// Sets values and gradients from a linearisation.
    pub fn linearise(&mut self, shape: &Shape, at: &Linearisation) {
        let scaled = at.at.scaled.as_ref().expect("a point that was linearised has values");
        self.fill(shape, scaled, shape.dimension(), |row, weight, sum| {
            sum.iter_mut().zip(&at.rows[row]).for_each(|(sum, s)| *sum += weight * s);
        });
    }

    /// Sets values from scaled values, without gradients.
    pub fn evaluate(&mut self, shape: &Shape, scaled: &[f64]) {
        self.fill(shape, scaled, 0, |_, _, _| {});
    }

    /// Sets values from scaled values, and gradients of length `n`. `add` adds the gradient of a criterion, times a
    /// weight, to its last argument.
    pub fn fill(&mut self, shape: &Shape, scaled: &[f64], n: usize, mut add: impl FnMut(usize, f64, &mut [f64])) {
        let is_sum = shape.objective == Objective::Sum;
        let mut lengths = [0; 3];
        for (i, ((usage, weight), value)) in shape.rows.iter().zip(scaled).enumerate() {
            let (group, weight, criteria) = match usage {
                Usage::Minimise => (0, *weight, &mut self.objectives),
                Usage::Inequality => (1, 1.0, &mut self.inequalities),
                Usage::Equality => (2, 1.0, &mut self.equalities),
                Usage::Monitor => continue,
            };
            if group > 0 || !is_sum || lengths[0] == 0 {
                reset(criteria, lengths[group], n);
                lengths[group] += 1;
            }
            let row = &mut criteria[lengths[group] - 1];
            row.value += weight * value - if group > 0 { 1.0 } else { 0.0 };
            add(i, weight, &mut row.gradient);
        }
        if lengths[0] == 0 {
            reset(&mut self.objectives, 0, n);
            lengths[0] = 1;
        }
        self.objectives.truncate(lengths[0]);
        self.inequalities.truncate(lengths[1]);
        self.equalities.truncate(lengths[2]);
    }

    /// Returns a factor that brings the objective to the order of 1; 1 if its magnitude is 0 or between 1e-3 and 1e3.
    /// Scaled values are of order 1 unless the demands are far from what is achievable.
    pub fn objective_scale(&self) -> f64 {
        let largest = self.objectives.iter().map(|row| row.value.abs()).fold(0.0, f64::max);
        if (1e-3..1e3).contains(&largest) || largest == 0.0 { 1.0 } else { 1.0 / largest }
    }

    /// Multiplies the objective by a factor.
    pub fn scale_objective(&mut self, factor: f64) {
        for row in &mut self.objectives {
            row.value *= factor;
            row.gradient.iter_mut().for_each(|s| *s *= factor);
        }
    }

    /// Returns the objective: the largest of its functions.
    pub fn objective(&self) -> f64 {
        self.objectives.iter().map(|row| row.value).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the largest constraint violation; 0 if all constraints are satisfied.
    pub fn violation(&self) -> f64 {
        let inequality = self.inequalities.iter().map(|row| row.value).fold(0.0, f64::max);
        self.equalities.iter().map(|row| row.value.abs()).fold(inequality, f64::max)
    }

    /// Computes the gradient of the Lagrangian for given multipliers.
    pub fn lagrangian_gradient(&self, multipliers: &Multipliers, gradient: &mut Vec<f64>) {
        gradient.clear();
        gradient.resize(self.objectives[0].gradient.len(), 0.0);
        let parts = [
            (&self.objectives, &multipliers.objectives),
            (&self.inequalities, &multipliers.inequalities),
            (&self.equalities, &multipliers.equalities),
        ];
        for (criteria, multipliers) in parts {
            for (row, multiplier) in criteria.iter().zip(multipliers) {
                for (sum, s) in gradient.iter_mut().zip(&row.gradient) {
                    *sum += multiplier * s;
                }
            }
        }
    }

    /// Sets the criteria at `here`, followed by linear models from other points (cuts) extrapolated to `here`.
    ///
    /// A cut is lowered to the value at `here` if it exceeds it, so that no cut contradicts the known value. `offset`
    /// is a buffer.
    pub fn assign_with_cuts(
        &mut self,
        criteria: &Self,
        here: &[f64],
        cuts: &[(Vec<f64>, Self)],
        offset: &mut Vec<f64>,
    ) {
        let groups = [(&mut self.objectives, &criteria.objectives), (&mut self.inequalities, &criteria.inequalities)];
        for (all, criteria) in groups {
            all.resize_with(criteria.len() * (1 + cuts.len()), LinearModel::default);
            all[..criteria.len()].clone_from_slice(criteria);
        }
        self.equalities.clone_from(&criteria.equalities);
        for (k, (there, cut)) in cuts.iter().enumerate() {
            offset.clear();
            offset.extend(here.iter().zip(there).map(|(here, there)| here - there));
            append_cuts(&mut self.objectives, &criteria.objectives, &cut.objectives, (k, offset));
            append_cuts(&mut self.inequalities, &criteria.inequalities, &cut.inequalities, (k, offset));
        }
    }

    /// Sets the criteria of a second-order correction: the gradients at `here`, and the values at `there` minus those
    /// gradients times `step`.
    ///
    /// Source: J. Nocedal, S. Wright, Numerical Optimization, 2nd edition (2006), section 18.3.
    pub fn assign_second_order_correction(&mut self, here: &Self, there: &Self, step: &[f64]) {
        self.clone_from(here);
        let correct = |criteria: &mut [LinearModel], there: &[LinearModel]| {
            criteria.iter_mut().zip(there).for_each(|(row, there)| row.value = there.value - dot(&row.gradient, step));
        };
        correct(&mut self.objectives, &there.objectives);
        correct(&mut self.inequalities, &there.inequalities);
        correct(&mut self.equalities, &there.equalities);
    }
}

/// Writes the cuts of the `k`-th point behind the criteria.
fn append_cuts(all: &mut [LinearModel], criteria: &[LinearModel], cuts: &[LinearModel], (k, offset): (usize, &[f64])) {
    let begin = (k + 1) * criteria.len();
    for ((row, cut), upper_bound) in all[begin..].iter_mut().zip(cuts).zip(criteria) {
        row.clone_from(cut);
        row.value = (cut.value + dot(&cut.gradient, offset)).min(upper_bound.value);
    }
}

/// Sets the function at `index` to zero; appends it if `index` is the length of the list.
fn reset(criteria: &mut Vec<LinearModel>, index: usize, n: usize) {
    if index == criteria.len() {
        criteria.push(LinearModel::default());
    }
    let row = &mut criteria[index];
    row.value = 0.0;
    row.gradient.clear();
    row.gradient.resize(n, 0.0);
}

/// Lagrange multipliers of the criteria at a solution.
#[derive(Debug, Clone, Default)]
pub struct Multipliers {
    /// Multipliers of the objectives; their sum is 1.
    pub objectives: Vec<f64>,
    /// Multipliers of the inequalities.
    pub inequalities: Vec<f64>,
    /// Multipliers of the equalities, with sign.
    pub equalities: Vec<f64>,
}

impl Multipliers {
    /// Returns the sum of the absolute multipliers of the constraints.
    pub fn constraint_sum(&self) -> f64 {
        self.inequalities.iter().chain(&self.equalities).map(|m| m.abs()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(objective: Objective, usages: &[Usage]) -> Shape {
        let criteria = usages.iter().map(|usage| (*usage, 2.0)).collect();
        Shape { spacing: vec![0.0; 4], rows: criteria, objective, ..Shape::default() }
    }

    fn fill(criteria: &mut LinearisedCriteria, shape: &Shape) {
        let scaled: Vec<f64> = (1_u8..).map(f64::from).take(shape.rows.len()).collect();
        criteria.fill(shape, &scaled, 4, |i, weight, sum| sum.iter_mut().for_each(|s| *s += weight * scaled[i]));
    }

    #[test]
    fn filling_again_overwrites_all_values() {
        use Usage::{Equality, Inequality, Minimise, Monitor};
        let shapes = [
            shape(Objective::Max, &[Minimise, Inequality, Minimise, Equality, Inequality, Monitor]),
            shape(Objective::Sum, &[Minimise, Minimise, Equality, Minimise]),
            shape(Objective::Max, &[Monitor]),
            shape(Objective::Max, &[Inequality, Inequality]),
        ];
        let mut criteria = LinearisedCriteria::default();
        for shape in &shapes {
            fill(&mut criteria, shape);
            let mut fresh = LinearisedCriteria::default();
            fill(&mut fresh, shape);
            assert_eq!(format!("{criteria:?}"), format!("{fresh:?}"));
        }
        fill(&mut criteria, &shapes[1]);
        assert_eq!(
            (criteria.objectives.len(), criteria.objectives[0].value, &criteria.objectives[0].gradient),
            (1, 14.0, &vec![14.0; 4])
        );
        assert_eq!((criteria.inequalities.len(), criteria.equalities.len(), criteria.equalities[0].value), (0, 1, 2.0));
        fill(&mut criteria, &shapes[2]);
        assert_eq!((criteria.objectives.len(), criteria.objectives[0].value), (1, 0.0));
    }

    #[test]
    fn cuts_are_extrapolated_and_do_not_exceed_the_value() {
        let line = |value: f64, gradient: [f64; 4]| LinearisedCriteria {
            objectives: vec![LinearModel { value, gradient: gradient.to_vec() }],
            ..LinearisedCriteria::default()
        };
        let here = line(1.0, [0.0; 4]);
        let steep = (vec![0.0; 4], line(0.0, [1.0, 2.0, 3.0, 4.0]));
        let flat = (vec![1.0, 0.0, 0.0, 0.0], line(0.5, [0.0, 0.1, 0.1, 0.1]));
        let (mut all, mut offset) = (LinearisedCriteria::default(), Vec::new());
        all.assign_with_cuts(&here, &[1.0; 4], &[steep.clone(), flat.clone()], &mut offset);
        let values: Vec<f64> = all.objectives.iter().map(|row| row.value).collect();
        assert_eq!(values[..2], [1.0, 1.0]);
        assert!((values[2] - 0.8).abs() < 1e-15);
        all.assign_with_cuts(&here, &[1.0; 4], &[flat], &mut offset);
        assert_eq!((all.objectives.len(), all.objectives[1].value), (2, values[2]));
        all.assign_with_cuts(&here, &[1.0; 4], &[], &mut offset);
        assert_eq!(all.objectives.len(), 1);
    }
}
