//! The rows of a problem at a point: values and slopes, sorted by what they are for.

use mops_core::{Linearisation, Objective, Shape, Usage};

use crate::active_set::dot;
use crate::epigraph::Multipliers;

/// A function's value and slope.
#[derive(Debug, Clone)]
pub struct Linear {
    /// Value.
    pub value: f64,
    /// Slope along every coordinate.
    pub slope: Vec<f64>,
}

/// The rows of a problem at a point, sorted by what they are for.
#[derive(Debug, Clone)]
pub struct Rows {
    /// To be minimised: the largest of them. One row, their sum, where the objective is a sum.
    pub objectives: Vec<Linear>,
    /// At most 0.
    pub inequalities: Vec<Linear>,
    /// Equal to 0.
    pub equalities: Vec<Linear>,
}

impl Rows {
    /// The rows of a linearisation.
    pub fn of(shape: &Shape, at: &Linearisation) -> Self {
        let scaled = at.at.scaled.as_ref().expect("a point that was linearised has values");
        Self::new(shape, scaled, &at.rows)
    }

    /// The rows with the given scaled values and slopes.
    pub fn new(shape: &Shape, scaled: &[f64], slopes: &[Vec<f64>]) -> Self {
        let pick = |usage: Usage, offset: f64| -> Vec<Linear> {
            let rows = shape.rows.iter().zip(scaled).zip(slopes);
            rows.filter(|(((u, _), _), _)| *u == usage)
                .map(|(((_, weight), value), slope)| {
                    let weight = if usage == Usage::Minimise { *weight } else { 1.0 };
                    Linear { value: weight * value - offset, slope: slope.iter().map(|s| weight * s).collect() }
                })
                .collect()
        };
        let mut objectives = pick(Usage::Minimise, 0.0);
        if shape.objective == Objective::Sum || objectives.is_empty() {
            let n = shape.dimension();
            let sum = |slope: Vec<f64>, row: &Linear| slope.iter().zip(&row.slope).map(|(a, b)| a + b).collect();
            let slope =
                if slopes.iter().all(Vec::is_empty) { Vec::new() } else { objectives.iter().fold(vec![0.0; n], sum) };
            objectives = vec![Linear { value: objectives.iter().map(|row| row.value).sum(), slope }];
        }
        Self { objectives, inequalities: pick(Usage::Inequality, 1.0), equalities: pick(Usage::Equality, 1.0) }
    }

    /// A factor that brings the objective to the order of 1, where it is far from it: scaled values are near 1 unless
    /// the demands are far from what can be had.
    pub fn unit(&self) -> f64 {
        let largest = self.objectives.iter().map(|row| row.value.abs()).fold(0.0, f64::max);
        if (1e-3..1e3).contains(&largest) || largest == 0.0 { 1.0 } else { 1.0 / largest }
    }

    /// The same rows with the objective in other units.
    #[must_use]
    pub fn with_objective_times(mut self, factor: f64) -> Self {
        for row in &mut self.objectives {
            row.value *= factor;
            row.slope.iter_mut().for_each(|s| *s *= factor);
        }
        self
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

    /// The slope of the Lagrangian for the given multipliers.
    pub fn lagrangian_slope(&self, multipliers: &Multipliers) -> Vec<f64> {
        let n = self.objectives[0].slope.len();
        let mut slope = vec![0.0; n];
        let parts = [
            (&self.objectives, &multipliers.objectives),
            (&self.inequalities, &multipliers.inequalities),
            (&self.equalities, &multipliers.equalities),
        ];
        for (rows, multipliers) in parts {
            for (row, multiplier) in rows.iter().zip(multipliers) {
                for (sum, s) in slope.iter_mut().zip(&row.slope) {
                    *sum += multiplier * s;
                }
            }
        }
        slope
    }

    /// Adds the rows of another point as they extend to here, a distance `back` away from it; none above the row here, so
    /// that no piece contradicts what is known.
    pub fn add_pieces(&mut self, other: &Self, back: &[f64]) {
        let extend = |rows: &mut Vec<Linear>, pieces: &[Linear]| {
            let here: Vec<f64> = rows.iter().take(pieces.len()).map(|row| row.value).collect();
            rows.extend(pieces.iter().zip(here).map(|(piece, here)| Linear {
                value: (piece.value + dot(&piece.slope, back)).min(here),
                slope: piece.slope.clone(),
            }));
        };
        extend(&mut self.objectives, &other.objectives);
        extend(&mut self.inequalities, &other.inequalities);
    }

    /// The same slopes with the values `at` minus the slopes along `step`: the rows of a second-order correction.
    /// Source: J. Nocedal, S. Wright, Numerical Optimization, 2nd edition (2006), section 18.3.
    #[must_use]
    pub fn corrected(&self, at: &Self, step: &[f64]) -> Self {
        let correct = |rows: &[Linear], values: &[Linear]| {
            let value = |(row, at): (&Linear, &Linear)| Linear {
                value: at.value - dot(&row.slope, step),
                slope: row.slope.clone(),
            };
            rows.iter().zip(values).map(value).collect()
        };
        Self {
            objectives: correct(&self.objectives, &at.objectives),
            inequalities: correct(&self.inequalities, &at.inequalities),
            equalities: correct(&self.equalities, &at.equalities),
        }
    }
}
