//! The rows of a problem at a point: values and slopes, sorted by what they are for.

use mops_core::{Linearisation, Objective, Shape, Usage};

use crate::active_set::dot;
use crate::epigraph::Multipliers;

/// A function's value and slope.
#[derive(Debug, Default)]
pub struct Linear {
    /// Value.
    pub value: f64,
    /// Slope along every coordinate.
    pub slope: Vec<f64>,
}

impl Clone for Linear {
    fn clone(&self) -> Self {
        Self { value: self.value, slope: self.slope.clone() }
    }

    fn clone_from(&mut self, other: &Self) {
        self.value = other.value;
        self.slope.clone_from(&other.slope);
    }
}

/// The rows of a problem at a point, sorted by what they are for. They are filled again from point to point: memory once asked
/// for is kept.
#[derive(Debug, Default)]
pub struct Rows {
    /// To be minimised: the largest of them. One row, their sum, where the objective is a sum.
    pub objectives: Vec<Linear>,
    /// At most 0.
    pub inequalities: Vec<Linear>,
    /// Equal to 0.
    pub equalities: Vec<Linear>,
}

impl Clone for Rows {
    fn clone(&self) -> Self {
        let mut rows = Self::default();
        rows.clone_from(self);
        rows
    }

    fn clone_from(&mut self, other: &Self) {
        self.objectives.clone_from(&other.objectives);
        self.inequalities.clone_from(&other.inequalities);
        self.equalities.clone_from(&other.equalities);
    }
}

impl Rows {
    /// The rows of a linearisation.
    pub fn of(shape: &Shape, at: &Linearisation) -> Self {
        let mut rows = Self::default();
        rows.linearise(shape, at);
        rows
    }

    /// The rows of given scaled values, without slopes.
    pub fn of_values(shape: &Shape, scaled: &[f64]) -> Self {
        let mut rows = Self::default();
        rows.evaluate(shape, scaled);
        rows
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
        let joined = shape.objective == Objective::Sum;
        let mut counts = [0; 3];
        for (i, ((usage, weight), value)) in shape.rows.iter().zip(scaled).enumerate() {
            let (group, weight, rows) = match usage {
                Usage::Minimise => (0, *weight, &mut self.objectives),
                Usage::Inequality => (1, 1.0, &mut self.inequalities),
                Usage::Equality => (2, 1.0, &mut self.equalities),
                Usage::Monitor => continue,
            };
            if group > 0 || !joined || counts[0] == 0 {
                clear(rows, counts[group], n);
                counts[group] += 1;
            }
            let row = &mut rows[counts[group] - 1];
            row.value += weight * value - if group > 0 { 1.0 } else { 0.0 };
            add(i, weight, &mut row.slope);
        }
        if counts[0] == 0 {
            clear(&mut self.objectives, 0, n);
            counts[0] = 1;
        }
        self.objectives.truncate(counts[0]);
        self.inequalities.truncate(counts[1]);
        self.equalities.truncate(counts[2]);
    }

    /// A factor that brings the objective to the order of 1, where it is far from it: scaled values are near 1 unless
    /// the demands are far from what can be had.
    pub fn unit(&self) -> f64 {
        let largest = self.objectives.iter().map(|row| row.value.abs()).fold(0.0, f64::max);
        if (1e-3..1e3).contains(&largest) || largest == 0.0 { 1.0 } else { 1.0 / largest }
    }

    /// Takes the objective in other units.
    pub fn multiply_objective(&mut self, factor: f64) {
        for row in &mut self.objectives {
            row.value *= factor;
            row.slope.iter_mut().for_each(|s| *s *= factor);
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
    pub fn lagrangian_slope(&self, multipliers: &Multipliers, slope: &mut Vec<f64>) {
        slope.clear();
        slope.resize(self.objectives[0].slope.len(), 0.0);
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
    }

    /// Becomes the rows of a point `here`, with those of other points as they extend to it; none above the row here, so that no
    /// piece contradicts what is known.
    pub fn gather(&mut self, rows: &Self, here: &[f64], pieces: &[(Vec<f64>, Self)]) {
        let gather = |all: &mut Vec<Linear>, rows: &[Linear], of: fn(&Self) -> &[Linear]| {
            all.resize_with(rows.len() * (1 + pieces.len()), Linear::default);
            let (first, others) = all.split_at_mut(rows.len());
            first.clone_from_slice(rows);
            let pieces =
                pieces.iter().flat_map(|(there, piece)| of(piece).iter().zip(rows).map(move |pair| (there, pair)));
            for (row, (there, (piece, highest))) in others.iter_mut().zip(pieces) {
                row.clone_from(piece);
                let back = here.iter().zip(there).map(|(here, there)| here - there);
                row.value += piece.slope.iter().zip(back).map(|(slope, back)| slope * back).sum::<f64>();
                row.value = row.value.min(highest.value);
            }
        };
        gather(&mut self.objectives, &rows.objectives, |piece| &piece.objectives);
        gather(&mut self.inequalities, &rows.inequalities, |piece| &piece.inequalities);
        self.equalities.clone_from(&rows.equalities);
    }

    /// Becomes the rows of a second-order correction: the slopes of `here`, with the values of `there` minus those slopes along
    /// `step`.
    ///
    /// Source: J. Nocedal, S. Wright, Numerical Optimization, 2nd edition (2006), section 18.3.
    pub fn correct(&mut self, here: &Self, there: &Self, step: &[f64]) {
        self.clone_from(here);
        let correct = |rows: &mut [Linear], there: &[Linear]| {
            rows.iter_mut().zip(there).for_each(|(row, there)| row.value = there.value - dot(&row.slope, step));
        };
        correct(&mut self.objectives, &there.objectives);
        correct(&mut self.inequalities, &there.inequalities);
        correct(&mut self.equalities, &there.equalities);
    }
}

/// Makes the row at `index`, which may be the first beyond the last, a function that is 0.
fn clear(rows: &mut Vec<Linear>, index: usize, n: usize) {
    if index == rows.len() {
        rows.push(Linear::default());
    }
    let row = &mut rows[index];
    row.value = 0.0;
    row.slope.clear();
    row.slope.resize(n, 0.0);
}
