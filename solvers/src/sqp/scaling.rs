//! Scaling of the gradients of all criteria to the order of 1.

use crate::linearised_criteria::{LinearModel, LinearisedCriteria};

/// One scale factor for the objective and one for every constraint; the latter are at most 1.
///
/// Source: A. Waechter, L. T. Biegler, Mathematical Programming 106 (2006) 25-57, section 3.8.
#[derive(Debug)]
pub(super) struct Scaling {
    objective: f64,
    inequalities: Vec<f64>,
    equalities: Vec<f64>,
}

impl Scaling {
    pub fn new(criteria: &LinearisedCriteria) -> Self {
        let norm = criteria.objectives.iter().map(gradient_norm).fold(0.0, f64::max);
        let usable = norm > 1e-100 && norm.is_finite();
        Self {
            objective: if usable { 1.0 / norm } else { 1.0 },
            inequalities: criteria.inequalities.iter().map(|row| shrinking_factor(gradient_norm(row))).collect(),
            equalities: criteria.equalities.iter().map(|row| shrinking_factor(gradient_norm(row))).collect(),
        }
    }

    /// Returns the scale factor of the objective.
    pub fn objective(&self) -> f64 {
        self.objective
    }

    /// Updates the scale factors of constraints whose gradients have changed substantially.
    pub fn update(&mut self, criteria: &mut LinearisedCriteria) {
        let update = |(row, factor): (&mut LinearModel, &mut f64)| {
            let change = shrinking_factor(gradient_norm(row) / *factor) / *factor;
            if !(0.01..=30.0).contains(&change) {
                *factor *= change;
                scale_by(row, change);
            }
        };
        criteria.inequalities.iter_mut().zip(&mut self.inequalities).for_each(update);
        criteria.equalities.iter_mut().zip(&mut self.equalities).for_each(update);
    }

    pub fn apply(&self, criteria: &mut LinearisedCriteria) {
        criteria.objectives.iter_mut().for_each(|row| scale_by(row, self.objective));
        criteria.inequalities.iter_mut().zip(&self.inequalities).for_each(|(row, &factor)| scale_by(row, factor));
        criteria.equalities.iter_mut().zip(&self.equalities).for_each(|(row, &factor)| scale_by(row, factor));
    }
}

fn gradient_norm(row: &LinearModel) -> f64 {
    row.gradient.iter().fold(0.0, |most, s| most.max(s.abs()))
}

fn shrinking_factor(norm: f64) -> f64 {
    1.0 / norm.max(1.0)
}

fn scale_by(row: &mut LinearModel, factor: f64) {
    row.value *= factor;
    row.gradient.iter_mut().for_each(|s| *s *= factor);
}
