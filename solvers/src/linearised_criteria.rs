//! The rows of a problem at a point: values and slopes, sorted by what they are for.

use mops_core::{Linearisation, Objective, Shape, Usage};

use crate::active_set::dot;

/// A function's value and slope.
#[derive(Debug, Default)]
pub struct LinearModel {
    /// Value.
    pub value: f64,
    /// Slope along every coordinate.
    pub gradient: Vec<f64>,
}

// N.B.: a derived `clone_from` asks for memory anew.
impl Clone for LinearModel {
    fn clone(&self) -> Self {
        Self { value: self.value, gradient: self.gradient.clone() }
    }

    fn clone_from(&mut self, other: &Self) {
        self.value = other.value;
        self.gradient.clone_from(&other.gradient);
    }
}

/// The rows of a problem at a point, sorted by what they are for. They are filled again from point to point: memory once asked
/// for is kept.
#[derive(Debug, Default)]
pub struct LinearisedCriteria {
    /// To be minimised: the largest of them. One row, their sum, where the objective is a sum.
    pub objectives: Vec<LinearModel>,
    /// At most 0.
    pub inequalities: Vec<LinearModel>,
    /// Equal to 0.
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
    /// The rows of a linearisation.
    pub fn from_linearisation(shape: &Shape, at: &Linearisation) -> Self {
        let mut criteria = Self::default();
        criteria.linearise(shape, at);
        criteria
    }

    /// The rows of given scaled values, without slopes.
    pub fn from_values(shape: &Shape, scaled: &[f64]) -> Self {
        let mut criteria = Self::default();
        criteria.evaluate(shape, scaled);
        criteria
    }

    /// Becomes the rows of a linearisation.
    pub fn linearise(&mut self, shape: &Shape, at: &Linearisation) {
        let scaled = at.at.scaled.as_ref().expect("a point that was linearised has values");
        self.fill(shape, scaled, shape.dimension(), |row, weight, sum| {
            sum.iter_mut().zip(&at.rows[row]).for_each(|(sum, s)| *sum += weight * s);
        });
    }

    /// Becomes the rows of given scaled values, without slopes.
    pub fn evaluate(&mut self, shape: &Shape, scaled: &[f64]) {
        self.fill(shape, scaled, 0, |_, _, _| {});
    }

    /// Becomes the rows of given scaled values, with slopes of length `n`: `add` adds the slope of a row, times a weight, to
    /// what it is given.
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

    /// A factor that brings the objective to the order of 1, where it is far from it: scaled values are near 1 unless
    /// the demands are far from what can be had.
    pub fn objective_scale(&self) -> f64 {
        let largest = self.objectives.iter().map(|row| row.value.abs()).fold(0.0, f64::max);
        if (1e-3..1e3).contains(&largest) || largest == 0.0 { 1.0 } else { 1.0 / largest }
    }

    /// Takes the objective in other units.
    pub fn scale_objective(&mut self, factor: f64) {
        for row in &mut self.objectives {
            row.value *= factor;
            row.gradient.iter_mut().for_each(|s| *s *= factor);
        }
    }

    /// The objective: the largest of its rows.
    pub fn objective(&self) -> f64 {
        self.objectives.iter().map(|row| row.value).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The largest violation of a constraint; 0 if all hold.
    pub fn violation(&self) -> f64 {
        let inequality = self.inequalities.iter().map(|row| row.value).fold(0.0, f64::max);
        self.equalities.iter().map(|row| row.value.abs()).fold(inequality, f64::max)
    }

    /// The slope of the Lagrangian for the given multipliers, into `slope`.
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

    /// Becomes the rows of a point `here`, with those of other points as they extend to it; none above the row here, so that no
    /// piece contradicts what is known. `back` is room for the way from a point to here.
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

    /// Becomes the rows of a second-order correction: the slopes of `here`, with the values of `there` minus those slopes along
    /// `step`.
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

/// Puts the pieces of one more point, the `k`-th, after the rows.
fn append_cuts(all: &mut [LinearModel], criteria: &[LinearModel], cuts: &[LinearModel], (k, offset): (usize, &[f64])) {
    let begin = (k + 1) * criteria.len();
    for ((row, cut), upper_bound) in all[begin..].iter_mut().zip(cuts).zip(criteria) {
        row.clone_from(cut);
        row.value = (cut.value + dot(&cut.gradient, offset)).min(upper_bound.value);
    }
}

/// Makes the row at `index`, which may be the first beyond the last, a function that is 0.
fn reset(criteria: &mut Vec<LinearModel>, index: usize, n: usize) {
    if index == criteria.len() {
        criteria.push(LinearModel::default());
    }
    let row = &mut criteria[index];
    row.value = 0.0;
    row.gradient.clear();
    row.gradient.resize(n, 0.0);
}

/// What the rows weigh at the solution.
#[derive(Debug, Clone, Default)]
pub struct Multipliers {
    /// Of the objective rows; they sum to 1.
    pub objectives: Vec<f64>,
    /// Of the inequalities.
    pub inequalities: Vec<f64>,
    /// Of the equalities, signed.
    pub equalities: Vec<f64>,
}

impl Multipliers {
    /// The sum of those of constraints.
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
    fn a_second_filling_forgets_the_first() {
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
    fn pieces_extend_to_here_and_stay_below_the_row() {
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
