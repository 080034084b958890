//! The quadratic subproblem of a min-max problem in its smooth (epigraph) form, with elastic constraints.
//!
//! With values and slopes of the rows at a point, find the step `d` that solves
//! ```text
//! min over d, t, e   1/2 d'Bd + t + penalty e
//! subject to         f_i + g_i d <= t         every objective row
//!                    c_j + a_j d <= e         every inequality
//!                    |h_k + b_k d| <= e       every equality
//!                    low <= d <= high,  e >= 0
//! ```
//! It has a solution whatever the rows: where the linearised constraints contradict each other, `e` stays positive.

use mops_core::{Linearisation, Objective, Shape, Usage};
use nalgebra::DMatrix;

use crate::active_set::{ActiveSet, Constraints, dot};

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

/// What the rows weigh at the solution.
#[derive(Debug, Clone)]
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

/// The solution of the subproblem.
#[derive(Debug, Clone)]
pub struct Direction {
    /// The step.
    pub step: Vec<f64>,
    /// The largest linearised objective row after it.
    pub level: f64,
    /// The largest linearised violation after it.
    pub violation: f64,
    /// What the rows weigh.
    pub multipliers: Multipliers,
}

/// Solves the subproblem for steps between `low` and `high`; `None` where the Hessian is not positive definite or rounding
/// keeps the method from an end.
pub fn solve(rows: &Rows, hessian: &DMatrix<f64>, low: &[f64], high: &[f64], penalty: f64) -> Option<Direction> {
    Subproblem::default().solve(rows, hessian, low, high, penalty)
}

/// The subproblem, with its memory, which is used again from step to step.
///
/// Level and elastic violation have no curvature of their own. They get one that is small beside all others, about the level
/// here and about no violation, so that it does nothing at a solution.
#[derive(Debug, Default)]
pub struct Subproblem {
    method: ActiveSet,
    constraints: Constraints,
    factor: Vec<f64>,
    linear: Vec<f64>,
}

impl Subproblem {
    /// Curvature of level and violation, relative to what the objective can fall by.
    const CURVATURE: f64 = 1e-7;

    /// As [`solve`].
    pub fn solve(
        &mut self,
        rows: &Rows,
        hessian: &DMatrix<f64>,
        low: &[f64],
        high: &[f64],
        penalty: f64,
    ) -> Option<Direction> {
        let n = low.len();
        let level = rows.objective();
        let first = self.collect(rows, level, low, high);
        self.factor(hessian, &rows.objectives[first].slope)?;
        self.linear.clear();
        self.linear.resize(n, 0.0);
        self.linear.extend([1.0, penalty]);
        let no_violation = self.constraints.bounds.len() - 1;
        if !self.method.solve(&self.factor, &self.linear, &self.constraints, &[first, no_violation]) {
            return None;
        }
        let step: Vec<f64> = (0..n).map(|j| self.method.x()[j].clamp(low[j], high[j])).collect();
        let after = |rows: &[Linear], step: &[f64]| {
            rows.iter().map(|row| row.value + dot(&row.slope, step)).collect::<Vec<f64>>()
        };
        let violation = after(&rows.inequalities, &step).into_iter().fold(0.0, f64::max);
        let violation = after(&rows.equalities, &step).into_iter().map(f64::abs).fold(violation, f64::max);
        Some(Direction {
            level: after(&rows.objectives, &step).into_iter().fold(f64::NEG_INFINITY, f64::max),
            violation,
            multipliers: self.multipliers(rows),
            step,
        })
    }

    /// The rows as constraints on step, level and violation, in the order of `rows`, then the box, then no violation; the
    /// index of the largest objective row.
    fn collect(&mut self, rows: &Rows, level: f64, low: &[f64], high: &[f64]) -> usize {
        self.constraints.clear();
        for row in &rows.objectives {
            self.push(row, -1.0, [1.0, 0.0], row.value - level);
        }
        for row in &rows.inequalities {
            self.push(row, -1.0, [0.0, 1.0], row.value);
        }
        for row in &rows.equalities {
            self.push(row, -1.0, [0.0, 1.0], row.value);
            self.push(row, 1.0, [0.0, 1.0], -row.value);
        }
        let n = low.len();
        for (j, (low, high)) in low.iter().zip(high).enumerate() {
            for (sign, bound) in [(1.0, *low), (-1.0, -high)] {
                let begin = self.constraints.normals.len();
                self.constraints.normals.resize(begin + n + 2, 0.0);
                self.constraints.normals[begin + j] = sign;
                self.constraints.bounds.push(bound);
            }
        }
        self.constraints.normals.extend(std::iter::repeat_n(0.0, n + 1).chain([1.0]));
        self.constraints.bounds.push(0.0);
        rows.objectives.iter().position(|row| row.value >= level).unwrap_or(0)
    }

    fn push(&mut self, row: &Linear, sign: f64, rest: [f64; 2], bound: f64) {
        self.constraints.normals.extend(row.slope.iter().map(|s| sign * s));
        self.constraints.normals.extend(rest);
        self.constraints.bounds.push(bound);
    }

    /// The Cholesky factor of the Hessian and of the small curvatures.
    fn factor(&mut self, hessian: &DMatrix<f64>, slope: &[f64]) -> Option<()> {
        let n = slope.len();
        let size = n + 2;
        self.factor.clear();
        self.factor.resize(size * size, 0.0);
        let l = &mut self.factor;
        for k in 0..n {
            for i in k..n {
                let known: f64 = (0..k).map(|m| l[m * size + i] * l[m * size + k]).sum();
                let left = hessian[(i, k)] - known;
                l[k * size + i] = if i > k { left / l[k * size + k] } else { left.sqrt() };
            }
            if !(l[k * size + k] > 0.0 && l[k * size + k].is_finite()) {
                return None;
            }
        }
        // What the first row falls by without the others: |L^-1 g|^2.
        let mut y = slope.to_vec();
        for k in 0..n {
            y[k] = (y[k] - (0..k).map(|m| l[m * size + k] * y[m]).sum::<f64>()) / l[k * size + k];
        }
        let small = (Self::CURVATURE / (1.0 + dot(&y, &y))).sqrt();
        l[n * size + n] = small;
        l[(n + 1) * size + n + 1] = small;
        Some(())
    }

    fn multipliers(&self, rows: &Rows) -> Multipliers {
        let (f, c, h) = (rows.objectives.len(), rows.inequalities.len(), rows.equalities.len());
        let mut all = vec![0.0; f + c + h];
        for (p, multiplier) in self.method.active() {
            match p {
                p if p < f + c => all[p] = multiplier,
                p if p < f + c + 2 * h => {
                    let (row, side) = ((p - f - c) / 2, (p - f - c) % 2);
                    all[f + c + row] += if side == 0 { multiplier } else { -multiplier };
                }
                _ => {}
            }
        }
        let equalities = all.split_off(f + c);
        let inequalities = all.split_off(f);
        Multipliers { objectives: all, inequalities, equalities }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(value: f64, slope: &[f64]) -> Linear {
        Linear { value, slope: slope.to_vec() }
    }

    #[test]
    fn two_crossing_lines_meet_in_the_middle() {
        // max(1 + d, 1 - 2 d) without curvature: d = 0 is the best; max(1 + d, 4 - 2 d): d = 1, level 2.
        let rows = Rows {
            objectives: vec![linear(1.0, &[1.0]), linear(4.0, &[-2.0])],
            inequalities: vec![],
            equalities: vec![],
        };
        let d = solve(&rows, &(DMatrix::identity(1, 1) * 1e-6), &[-5.0], &[5.0], 1.0).unwrap();
        assert!((d.step[0] - 1.0).abs() < 1e-8 && (d.level - 2.0).abs() < 1e-8, "{d:?}");
        assert!((d.multipliers.objectives[0] - 2.0 / 3.0).abs() < 1e-6, "{d:?}");
    }

    #[test]
    fn contradicting_constraints_are_violated_as_little_as_can_be() {
        // d <= -1 and d >= 1 cannot hold: the best is d = 0, violated by 1.
        let rows = Rows {
            objectives: vec![linear(0.0, &[0.1])],
            inequalities: vec![linear(1.0, &[1.0]), linear(1.0, &[-1.0])],
            equalities: vec![],
        };
        let d = solve(&rows, &(DMatrix::identity(1, 1) * 1e-6), &[-5.0], &[5.0], 100.0).unwrap();
        assert!(d.step[0].abs() < 1e-7 && (d.violation - 1.0).abs() < 1e-7, "{d:?}");
    }

    #[test]
    fn an_equality_is_met_where_it_can_be() {
        let rows = Rows {
            objectives: vec![linear(0.0, &[1.0, 1.0])],
            inequalities: vec![],
            equalities: vec![linear(-1.0, &[1.0, -1.0])],
        };
        let d = solve(&rows, &DMatrix::identity(2, 2), &[-5.0; 2], &[5.0; 2], 10.0).unwrap();
        assert!((d.step[0] - d.step[1] - 1.0).abs() < 1e-8, "{d:?}");
    }
}
