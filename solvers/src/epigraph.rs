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

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use mops_core::{Linearisation, Objective, Shape, Usage};
use nalgebra::DMatrix;

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
            let slope = objectives.iter().fold(vec![0.0; n], sum);
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

/// The inner product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Solves the subproblem for steps between `low` and `high`; `None` if the interior-point method gives up.
pub fn solve(rows: &Rows, hessian: &DMatrix<f64>, low: &[f64], high: &[f64], penalty: f64) -> Option<Direction> {
    let n = low.len();
    let (level, elastic) = (n, n + 1);
    let mut constraints = Triplets::default();
    for row in &rows.objectives {
        constraints.row(&row.slope, &[(level, -1.0)], -row.value);
    }
    for row in &rows.inequalities {
        constraints.row(&row.slope, &[(elastic, -1.0)], -row.value);
    }
    for row in &rows.equalities {
        let negative: Vec<f64> = row.slope.iter().map(|s| -s).collect();
        constraints.row(&row.slope, &[(elastic, -1.0)], -row.value);
        constraints.row(&negative, &[(elastic, -1.0)], row.value);
    }
    for j in 0..n {
        constraints.row(&[], &[(j, 1.0)], high[j]);
        constraints.row(&[], &[(j, -1.0)], -low[j]);
    }
    constraints.row(&[], &[(elastic, -1.0)], 0.0);

    let mut quadratic = vec![Vec::new(); n + 2];
    for column in 0..n {
        quadratic[column] = (0..=column).map(|row| (row, hessian[(row, column)])).collect();
    }
    let mut linear = vec![0.0; n + 2];
    (linear[level], linear[elastic]) = (1.0, penalty);

    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-12,
        tol_gap_rel: 1e-12,
        tol_feas: 1e-12,
        max_threads: 1,
        ..DefaultSettings::default()
    };
    let cones = [SupportedConeT::NonnegativeConeT(constraints.bounds.len())];
    let (p, a) = (sparse(n + 2, &quadratic), constraints.matrix(n + 2));
    let mut solver = DefaultSolver::new(&p, &linear, &a, &constraints.bounds, &cones, settings).ok()?;
    solver.solve();
    // Close to the solution the strict tolerances may not be met; what is there then is still accurate to about 1e-8.
    let usable = [
        SolverStatus::Solved,
        SolverStatus::AlmostSolved,
        SolverStatus::InsufficientProgress,
        SolverStatus::MaxIterations,
    ];
    if !usable.contains(&solver.solution.status) || solver.solution.x.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let step: Vec<f64> = (0..n).map(|j| solver.solution.x[j].clamp(low[j], high[j])).collect();
    let z = &solver.solution.z;
    let (objectives, rest) = z.split_at(rows.objectives.len());
    let (inequalities, rest) = rest.split_at(rows.inequalities.len());
    let equalities = rest.chunks(2).take(rows.equalities.len()).map(|pair| pair[0] - pair[1]).collect();
    let after = |rows: &[Linear]| rows.iter().map(|row| row.value + dot(&row.slope, &step)).collect::<Vec<f64>>();
    let violation = after(&rows.inequalities).into_iter().fold(0.0, f64::max);
    let violation = after(&rows.equalities).into_iter().map(f64::abs).fold(violation, f64::max);
    Some(Direction {
        level: after(&rows.objectives).into_iter().fold(f64::NEG_INFINITY, f64::max),
        violation,
        multipliers: Multipliers { objectives: objectives.to_vec(), inequalities: inequalities.to_vec(), equalities },
        step,
    })
}

/// Rows of `A x <= b`, collected by columns.
#[derive(Default)]
struct Triplets {
    entries: Vec<(usize, usize, f64)>,
    bounds: Vec<f64>,
}

impl Triplets {
    fn row(&mut self, dense: &[f64], single: &[(usize, f64)], bound: f64) {
        let row = self.bounds.len();
        let dense = dense.iter().enumerate().map(|(column, value)| (column, *value));
        self.entries.extend(dense.chain(single.iter().copied()).filter(|(_, v)| *v != 0.0).map(|(c, v)| (row, c, v)));
        self.bounds.push(bound);
    }

    fn matrix(&self, columns: usize) -> CscMatrix<f64> {
        let mut by_column = vec![Vec::new(); columns];
        for (row, column, value) in &self.entries {
            by_column[*column].push((*row, *value));
        }
        sparse(self.bounds.len(), &by_column)
    }
}

fn sparse(rows: usize, columns: &[Vec<(usize, f64)>]) -> CscMatrix<f64> {
    let mut starts = vec![0];
    let (mut indices, mut values) = (Vec::new(), Vec::new());
    for column in columns {
        for (row, value) in column {
            indices.push(*row);
            values.push(*value);
        }
        starts.push(indices.len());
    }
    CscMatrix::new(rows, columns.len(), starts, indices, values)
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
        let d = solve(&rows, &DMatrix::zeros(1, 1), &[-5.0], &[5.0], 1.0).unwrap();
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
        let d = solve(&rows, &DMatrix::zeros(1, 1), &[-5.0], &[5.0], 100.0).unwrap();
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
