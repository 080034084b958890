//! The rows of a problem at a point: values and slopes, sorted by what they are for.

use mops_core::{Linearisation, Objective, Shape, Usage};

use crate::active_set::dot;

/// A function's value and slope.
#[derive(Debug, Default)]
pub struct Linear {
    /// Value.
    pub value: f64,
    /// Slope along every coordinate.
    pub slope: Vec<f64>,
}

// N.B.: a derived `clone_from` asks for memory anew.
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
    /// piece contradicts what is known. `back` is room for the way from a point to here.
    pub fn gather(&mut self, rows: &Self, here: &[f64], pieces: &[(Vec<f64>, Self)], back: &mut Vec<f64>) {
        let groups = [(&mut self.objectives, &rows.objectives), (&mut self.inequalities, &rows.inequalities)];
        for (all, rows) in groups {
            all.resize_with(rows.len() * (1 + pieces.len()), Linear::default);
            all[..rows.len()].clone_from_slice(rows);
        }
        self.equalities.clone_from(&rows.equalities);
        for (k, (there, piece)) in pieces.iter().enumerate() {
            back.clear();
            back.extend(here.iter().zip(there).map(|(here, there)| here - there));
            extend(&mut self.objectives, &rows.objectives, &piece.objectives, (k, back));
            extend(&mut self.inequalities, &rows.inequalities, &piece.inequalities, (k, back));
        }
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

/// Puts the pieces of one more point, the `k`-th, after the rows.
fn extend(all: &mut [Linear], rows: &[Linear], pieces: &[Linear], (k, back): (usize, &[f64])) {
    let begin = (k + 1) * rows.len();
    for ((row, piece), highest) in all[begin..].iter_mut().zip(pieces).zip(rows) {
        row.clone_from(piece);
        row.value = (piece.value + dot(&piece.slope, back)).min(highest.value);
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
    pub fn of_constraints(&self) -> f64 {
        self.inequalities.iter().chain(&self.equalities).map(|m| m.abs()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(objective: Objective, usages: &[Usage]) -> Shape {
        let rows = usages.iter().map(|usage| (*usage, 2.0)).collect();
        Shape { spacing: vec![0.0; 4], rows, objective, ..Shape::default() }
    }

    fn filled(rows: &mut Rows, shape: &Shape) {
        let scaled: Vec<f64> = (1_u8..).map(f64::from).take(shape.rows.len()).collect();
        rows.fill(shape, &scaled, 4, |i, weight, sum| sum.iter_mut().for_each(|s| *s += weight * scaled[i]));
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
        let mut rows = Rows::default();
        for shape in &shapes {
            filled(&mut rows, shape);
            let mut fresh = Rows::default();
            filled(&mut fresh, shape);
            assert_eq!(format!("{rows:?}"), format!("{fresh:?}"));
        }
        filled(&mut rows, &shapes[1]);
        assert_eq!(
            (rows.objectives.len(), rows.objectives[0].value, &rows.objectives[0].slope),
            (1, 14.0, &vec![14.0; 4])
        );
        assert_eq!((rows.inequalities.len(), rows.equalities.len(), rows.equalities[0].value), (0, 1, 2.0));
        filled(&mut rows, &shapes[2]);
        assert_eq!((rows.objectives.len(), rows.objectives[0].value), (1, 0.0));
    }

    #[test]
    fn pieces_extend_to_here_and_stay_below_the_row() {
        let line = |value: f64, slope: [f64; 4]| Rows {
            objectives: vec![Linear { value, slope: slope.to_vec() }],
            ..Rows::default()
        };
        let here = line(1.0, [0.0; 4]);
        let steep = (vec![0.0; 4], line(0.0, [1.0, 2.0, 3.0, 4.0]));
        let flat = (vec![1.0, 0.0, 0.0, 0.0], line(0.5, [0.0, 0.1, 0.1, 0.1]));
        let (mut all, mut back) = (Rows::default(), Vec::new());
        all.gather(&here, &[1.0; 4], &[steep.clone(), flat.clone()], &mut back);
        let values: Vec<f64> = all.objectives.iter().map(|row| row.value).collect();
        assert_eq!(values[..2], [1.0, 1.0]);
        assert!((values[2] - 0.8).abs() < 1e-15);
        all.gather(&here, &[1.0; 4], &[flat], &mut back);
        assert_eq!((all.objectives.len(), all.objectives[1].value), (2, values[2]));
        all.gather(&here, &[1.0; 4], &[], &mut back);
        assert_eq!(all.objectives.len(), 1);
    }
}
