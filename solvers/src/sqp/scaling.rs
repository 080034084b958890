//! Factors that bring the slopes of all rows to the order of 1.

use crate::rows::{Linear, Rows};

/// One factor for the objective, one for every constraint; those of constraints shrink only.
///
/// Source: A. Waechter, L. T. Biegler, Mathematical Programming 106 (2006) 25-57, section 3.8.
#[derive(Debug)]
pub(super) struct Scaling {
    objective: f64,
    inequalities: Vec<f64>,
    equalities: Vec<f64>,
}

impl Scaling {
    pub fn of(rows: &Rows) -> Self {
        let slope = rows.objectives.iter().map(steepest).fold(0.0, f64::max);
        let usable = slope > 1e-100 && slope.is_finite();
        Self {
            objective: if usable { 1.0 / slope } else { 1.0 },
            inequalities: rows.inequalities.iter().map(|row| shrink(steepest(row))).collect(),
            equalities: rows.equalities.iter().map(|row| shrink(steepest(row))).collect(),
        }
    }

    /// The factor of the objective.
    pub fn objective(&self) -> f64 {
        self.objective
    }

    /// Renews the factors of constraints whose slopes have changed by much.
    pub fn renew(&mut self, rows: &mut Rows) {
        let renew = |(row, factor): (&mut Linear, &mut f64)| {
            let change = shrink(steepest(row) / *factor) / *factor;
            if !(0.01..=30.0).contains(&change) {
                *factor *= change;
                times(row, change);
            }
        };
        rows.inequalities.iter_mut().zip(&mut self.inequalities).for_each(renew);
        rows.equalities.iter_mut().zip(&mut self.equalities).for_each(renew);
    }

    pub fn apply(&self, rows: &mut Rows) {
        rows.objectives.iter_mut().for_each(|row| times(row, self.objective));
        rows.inequalities.iter_mut().zip(&self.inequalities).for_each(|(row, &factor)| times(row, factor));
        rows.equalities.iter_mut().zip(&self.equalities).for_each(|(row, &factor)| times(row, factor));
    }
}

fn steepest(row: &Linear) -> f64 {
    row.slope.iter().fold(0.0, |most, s| most.max(s.abs()))
}

fn shrink(slope: f64) -> f64 {
    1.0 / slope.max(1.0)
}

fn times(row: &mut Linear, factor: f64) {
    row.value *= factor;
    row.slope.iter_mut().for_each(|s| *s *= factor);
}
