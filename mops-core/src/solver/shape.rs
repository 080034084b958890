//! Shape of a problem as solvers see it.

use crate::criterion::Usage;
use crate::evaluation::{Merit, Objective};

/// Problem description given to a solver: dimensions and kinds, no names.
///
/// The problem lives in the unit box: every point is in `[0, 1]^n`. Rows are criterion-case pairs.
/// Usage of the scaled value `s` of a row: `weight s` in the objective (minimise), `s - 1 <= 0` (inequality) or
/// `s - 1 = 0` (equality).
#[derive(Debug, Clone, Default)]
pub struct Shape {
    /// Distance between neighbouring values of every tuner; 0 for continuous tuners. The length is the dimension.
    pub spacing: Vec<f64>,
    /// Logarithm of the ratio of the bounds of every tuner on a logarithmic scale, 0 on a linear one; empty if all are
    /// linear.
    pub log_ratios: Vec<f64>,
    /// Usage and weight of every row.
    pub rows: Vec<(Usage, f64)>,
    /// Combination of the minimised rows into one objective.
    pub objective: Objective,
    /// Index of the objective to which each minimised row belongs, in the order of these rows, if the objectives count
    /// each by itself. The value of an objective is the largest weighted scaled value of its rows. Empty if every row
    /// is an objective of its own.
    pub groups: Vec<usize>,
    /// Number of points requested for the Pareto front; 0 if not specified.
    pub points: usize,
    /// Length of the residual vector whose sum of squares is the objective; 0 if the objective is not a sum of squares.
    pub residuals: usize,
    /// Sum of squares up to which the residuals are noise: expectation plus three standard deviations of the sum for
    /// independent normal noise of the known levels; 0 if a level is unknown.
    pub noise: f64,
    /// Coordinates that act in a single experiment and whose initial guess follows from its data, such as initial
    /// states, by index.
    pub local: Vec<usize>,
}

/// Share of the noise below which the residuals are too small for noise of the stated levels.
pub(super) const FAR_BELOW_NOISE: f64 = 0.1;

/// Number of residuals per tuner below which several optima may lie within the noise, as with two exponentials and 41
/// samples.
pub(super) const RESIDUALS_PER_TUNER: usize = 30;

impl Shape {
    /// Returns true if the sum of squares is at the level of the measurement noise, so that no other point fits
    /// significantly better. Requires many residuals per tuner.
    pub fn is_noise(&self, sum: f64) -> bool {
        let are_many = self.residuals >= RESIDUALS_PER_TUNER * self.dimension();
        are_many && self.noise > 0.0 && (FAR_BELOW_NOISE * self.noise..=self.noise).contains(&sum)
    }

    /// Returns the number of tuners.
    pub fn dimension(&self) -> usize {
        self.spacing.len()
    }

    /// Returns the objectives: the weighted scaled values of the rows to be minimised, or the largest one of each
    /// group.
    pub fn objectives(&self, scaled: &[f64]) -> Vec<f64> {
        let mut objectives = Vec::with_capacity(self.objective_count());
        self.append_objectives(scaled, &mut objectives);
        objectives
    }

    /// Appends the objectives, as [`Shape::objectives`], to a vector.
    pub fn append_objectives(&self, scaled: &[f64], to: &mut Vec<f64>) {
        let values = self.rows.iter().zip(scaled).filter(|((usage, _), _)| *usage == Usage::Minimise);
        let values = values.map(|((_, weight), s)| weight * s);
        if self.groups.is_empty() {
            to.extend(values);
            return;
        }
        let first = to.len();
        to.resize(first + self.objective_count(), f64::NEG_INFINITY);
        for (&group, value) in self.groups.iter().zip(values) {
            to[first + group] = to[first + group].max(value);
        }
    }

    /// Returns the number of objectives.
    pub fn objective_count(&self) -> usize {
        match self.groups.iter().max() {
            Some(last) => last + 1,
            None => self.rows.iter().filter(|(usage, _)| *usage == Usage::Minimise).count(),
        }
    }

    /// Returns the index of the objective to which each minimised row belongs, in the order of these rows.
    pub fn objective_of_rows(&self) -> Vec<usize> {
        if self.groups.is_empty() { (0..self.objective_count()).collect() } else { self.groups.clone() }
    }

    /// Returns the inequality constraints, satisfied if at most 0.
    pub fn inequalities(&self, scaled: &[f64]) -> Vec<f64> {
        self.pick(Usage::Inequality, scaled, |s, _| s - 1.0)
    }

    /// Returns the equality constraints, satisfied if 0.
    pub fn equalities(&self, scaled: &[f64]) -> Vec<f64> {
        self.pick(Usage::Equality, scaled, |s, _| s - 1.0)
    }

    fn pick(&self, usage: Usage, scaled: &[f64], f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        self.rows.iter().zip(scaled).filter(|((u, _), _)| *u == usage).map(|((_, w), &s)| f(s, *w)).collect()
    }

    /// Returns the merit of scaled values.
    pub fn merit(&self, scaled: &[f64]) -> Merit {
        let (mut violation, mut objective) = (0.0_f64, None);
        for ((usage, weight), s) in self.rows.iter().zip(scaled) {
            match (usage, self.objective) {
                (Usage::Minimise, Objective::Max | Objective::Each) => {
                    objective = Some(objective.map_or(weight * s, |worst: f64| worst.max(weight * s)));
                }
                (Usage::Minimise, Objective::Sum) => objective = Some(objective.unwrap_or(0.0) + weight * s),
                (Usage::Inequality, _) => violation = violation.max(s - 1.0),
                (Usage::Equality, _) => violation = violation.max((s - 1.0).abs()),
                (Usage::Monitor, _) => {}
            }
        }
        // A study with constraints alone is a feasibility problem.
        Merit { violation, objective: objective.unwrap_or(0.0) }
    }

    /// Returns true if any row is a constraint.
    pub fn has_constraints(&self) -> bool {
        self.rows.iter().any(|(usage, _)| matches!(usage, Usage::Inequality | Usage::Equality))
    }
}
