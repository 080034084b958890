//! Levenberg-Marquardt iteration within bounds, by QR factorisation: the core of the solver of that name and of the
//! fits of the diagnosis.

use mops_math as math;
use nalgebra::{DMatrix, DVector};

/// Iterate of the Levenberg-Marquardt method for a sum of squares `r'r` with bounds:
/// ```text
/// (J'J + lambda D^2) d = -J'r,   D^2 the largest diagonal of J'J so far
/// ```
/// Bounds are handled by an active set: coordinates that the step would move beyond a bound are fixed there, and the
/// step is recomputed.
///
/// The step is that of least squares with the rows of `J` and of `sqrt(lambda) D`.
///
/// Source: J. J. More, The Levenberg-Marquardt algorithm, Lecture Notes in Mathematics 630 (1978); damping by H. B.
/// Nielsen, report IMM-REP-1999-05, Technical University of Denmark (1999).
#[derive(Debug, Clone)]
pub struct LeastSquares {
    point: Vec<f64>,
    bounds: Vec<[f64; 2]>,
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
    /// Triangular factor `R` of the Jacobian `J = QR`, and `Q'r`.
    factor: DMatrix<f64>,
    target: DVector<f64>,
    /// Squared scale of every coordinate.
    scale: DVector<f64>,
    damping: f64,
    damping_growth: f64,
}

/// Step of [`LeastSquares`].
#[derive(Debug, Clone)]
pub struct LeastSquaresStep {
    /// Point after the step, within the bounds.
    pub to: Vec<f64>,
    /// Decrease of the sum of squares that the linear model predicts.
    pub predicted: f64,
}

/// Smallest squared scale of a coordinate.
const LEAST_SCALE: f64 = 1e-30;

/// Ratio of actual to predicted decrease up to which a step is rejected.
const REJECTED: f64 = 1e-4;

/// Largest factor of the damping by which a single ratio shortens a step. Half of that of the source passes kinks more
/// often.
///
/// Source: J. J. More, B. S. Garbow, K. E. Hillstrom, User guide for MINPACK-1, report ANL-80-74 (1980), `lmder`.
const MOST_GROWTH: f64 = 5.0;

/// Damping beyond which no step can make progress.
const MOST_DAMPING: f64 = 1e12;

impl LeastSquares {
    /// Begins at a point within the bounds, one pair for each coordinate.
    pub fn new(bounds: Vec<[f64; 2]>, point: Vec<f64>, residuals: DVector<f64>, jacobian: DMatrix<f64>) -> Self {
        let squared = jacobian.column_iter().map(|c| c.norm_squared().max(LEAST_SCALE));
        let scale = DVector::from_iterator(point.len(), squared);
        let (factor, target) = factorised(&residuals, &jacobian);
        Self { point, bounds, residuals, jacobian, factor, target, scale, damping: 1e-3, damping_growth: 2.0 }
    }

    /// Begins with a damping that an iteration nearby has ended with.
    #[must_use]
    pub fn damped(mut self, damping: f64) -> Self {
        self.damping = damping;
        self
    }

    /// Returns the damping `lambda` of the next step.
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// Returns the current point.
    pub fn point(&self) -> &[f64] {
        &self.point
    }

    /// Returns the sum of squares at the current point.
    pub fn sum(&self) -> f64 {
        self.residuals.norm_squared()
    }

    /// Returns the residuals at the current point.
    pub fn residuals(&self) -> &DVector<f64> {
        &self.residuals
    }

    /// Returns the derivatives of the residuals at the current point, one column for each coordinate.
    pub fn jacobian(&self) -> &DMatrix<f64> {
        &self.jacobian
    }

    /// Computes the damped step; `None` if no step is finite.
    pub fn step(&self) -> Option<LeastSquaresStep> {
        self.step_with(self.damping)
    }

    /// Computes the step with next to no damping; `None` if it is not finite. Its predicted decrease is the
    /// distance to the optimum where the problem is nearly linear.
    pub fn full_step(&self) -> Option<LeastSquaresStep> {
        self.step_with(1e-12)
    }

    fn step_with(&self, damping: f64) -> Option<LeastSquaresStep> {
        let step = self.bounded_step(damping)?;
        let predicted = self.sum() - (&self.residuals + &self.jacobian * &step).norm_squared();
        let moved = self.point.iter().zip(&step).zip(&self.bounds);
        Some(LeastSquaresStep { to: moved.map(|((u, d), b)| (u + d).clamp(b[0], b[1])).collect(), predicted })
    }

    /// Returns true if a step with this ratio of actual to predicted decrease is good enough to be accepted.
    pub fn accepts(ratio: f64) -> bool {
        ratio > REJECTED
    }

    /// Increases the damping after a step that was not accepted; `ratio` is that of actual to predicted decrease, of
    /// which the parabola through both sums of squares has its minimum at the share `1/(2 - ratio)` of the step.
    /// Returns false if no step can make progress any more.
    pub fn reject(&mut self, ratio: f64) -> bool {
        let shorter = if ratio.is_nan() { MOST_GROWTH } else { (2.0 - ratio).min(MOST_GROWTH) };
        self.damping = (self.damping * self.damping_growth.max(shorter)).min(MOST_DAMPING);
        self.damping_growth *= 2.0;
        self.damping < MOST_DAMPING
    }

    /// Moves to a point; `ratio` is the actual decrease of the sum of squares as a fraction of the predicted one.
    pub fn accept(&mut self, point: Vec<f64>, residuals: DVector<f64>, jacobian: DMatrix<f64>, ratio: f64) {
        for (scale, column) in self.scale.iter_mut().zip(jacobian.column_iter()) {
            *scale = scale.max(column.norm_squared());
        }
        (self.factor, self.target) = factorised(&residuals, &jacobian);
        (self.point, self.residuals, self.jacobian) = (point, residuals, jacobian);
        self.damping *= (1.0 - math::powi(2.0 * ratio - 1.0, 3)).max(1.0 / 3.0);
        self.damping_growth = 2.0;
    }

    /// Returns the largest cosine of the angle between the residuals and a column of the Jacobian, over the coordinates
    /// that no bound holds: 0 at an optimum.
    pub fn largest_cosine(&self) -> f64 {
        let norm = self.residuals.norm();
        let cosine = |j: usize| {
            let column = self.jacobian.column(j);
            let gradient = column.dot(&self.residuals);
            let ([low, high], u) = (self.bounds[j], self.point[j]);
            let fixed = (u <= low && gradient > 0.0) || (u >= high && gradient < 0.0);
            if fixed || gradient == 0.0 { 0.0 } else { gradient.abs() / (column.norm() * norm) }
        };
        (0..self.jacobian.ncols()).map(cosine).fold(0.0, f64::max)
    }

    /// Computes the damped step in the box: coordinates that would leave it are fixed at their bounds, one per pass.
    fn bounded_step(&self, damping: f64) -> Option<DVector<f64>> {
        let (point, n) = (&self.point, self.point.len());
        let mut fixed = DVector::<f64>::zeros(n);
        let mut free = vec![true; n];
        for _ in 0..=n {
            let indices: Vec<usize> = (0..n).filter(|&j| free[j]).collect();
            let mut step = fixed.clone();
            if !indices.is_empty() {
                let rows = self.factor.nrows();
                let mut stacked = self.factor.select_columns(&indices).resize_vertically(rows + indices.len(), 0.0);
                for (i, &j) in indices.iter().enumerate() {
                    stacked[(rows + i, i)] = (damping * self.scale[j]).sqrt();
                }
                let target = -(&self.target + &self.factor * &fixed);
                let (triangle, target) = factorised(&target.resize_vertically(rows + indices.len(), 0.0), &stacked);
                let solved = triangle.solve_upper_triangular(&target).filter(|s| s.iter().all(|x| x.is_finite()))?;
                for (i, &j) in indices.iter().enumerate() {
                    step[j] = solved[i];
                }
            }
            let outside =
                |j: usize| (point[j] + step[j] - self.bounds[j][1]).max(self.bounds[j][0] - (point[j] + step[j]));
            let worst = indices.iter().copied().max_by(|&i, &j| outside(i).total_cmp(&outside(j)));
            match worst.filter(|&j| outside(j) > 0.0) {
                None => return Some(step),
                Some(j) => {
                    free[j] = false;
                    fixed[j] = self.bounds[j][usize::from(step[j] > 0.0)] - point[j];
                }
            }
        }
        None
    }
}

/// Number of rows from which a matrix is factorised by chunks: below, nothing is gained.
const TALL: usize = 4096;

/// Number of rows of a chunk, and smallest number per column.
const CHUNK: usize = 256;
const ROWS_PER_COLUMN: usize = 4;

/// Returns the triangular factor `R` of a matrix `J = QR`, and `Q'r`. The condition of `J` is not squared, as by normal
/// equations.
///
/// A tall matrix is factorised by chunks of rows, without the columns that vanish in a chunk, and then the factors of
/// all chunks together: the time for coordinates that act in few rows each is linear in the number of rows.
///
/// Source: J. Demmel, L. Grigori, M. Hoemmen, J. Langou, SIAM Journal on Scientific Computing 34 (2012) A206-A239 (tall
/// and skinny QR).
fn factorised(residuals: &DVector<f64>, jacobian: &DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let (rows, n) = jacobian.shape();
    if rows < TALL || n == 0 {
        factorised_at_once(residuals, jacobian)
    } else {
        factorised_by_chunks(residuals, jacobian)
    }
}

fn factorised_by_chunks(residuals: &DVector<f64>, jacobian: &DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let (rows, n) = jacobian.shape();
    // Rows of the factors of all chunks: columns, their values, right-hand side.
    let mut factors: Vec<(Vec<usize>, DMatrix<f64>, DVector<f64>)> = Vec::new();
    let mut begin = 0;
    while begin < rows {
        let is_zero = |j: usize, count: usize| jacobian.column(j).rows(begin, count).iter().all(|slope| *slope == 0.0);
        let least = CHUNK.min(rows - begin);
        let columns = (0..n).filter(|&j| !is_zero(j, least)).count();
        let count = least.max(ROWS_PER_COLUMN * columns).min(rows - begin);
        let columns: Vec<usize> = (0..n).filter(|&j| !is_zero(j, count)).collect();
        let part = jacobian.rows(begin, count).select_columns(&columns);
        let (factor, target) = factorised_at_once(&residuals.rows(begin, count).into_owned(), &part);
        factors.push((columns, factor, target));
        begin += count;
    }
    let total = factors.iter().map(|(_, factor, _)| factor.nrows()).sum();
    let (mut stacked, mut target) = (DMatrix::zeros(total, n), DVector::zeros(total));
    let mut row = 0;
    for (columns, factor, part) in &factors {
        for (i, &j) in columns.iter().enumerate() {
            stacked.view_mut((row, j), (factor.nrows(), 1)).copy_from(&factor.column(i));
        }
        target.rows_mut(row, part.len()).copy_from(part);
        row += factor.nrows();
    }
    factorised_at_once(&target, &stacked)
}

fn factorised_at_once(residuals: &DVector<f64>, jacobian: &DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
    if jacobian.ncols() == 0 {
        return (DMatrix::zeros(0, 0), DVector::zeros(0));
    }
    let qr = jacobian.clone().qr();
    let mut target = residuals.clone();
    qr.q_tr_mul(&mut target);
    let factor = qr.r();
    let rows = factor.nrows();
    (factor, target.rows(0, rows).into_owned())
}

#[cfg(test)]
#[allow(clippy::cast_precision_loss)]
mod tests {
    use super::*;

    /// Rosenbrock's function as a sum of squares: `r = (10 (y - x^2), 1 - x)`.
    fn rosenbrock(point: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let (x, y) = (point[0], point[1]);
        let residuals = DVector::from_vec(vec![10.0 * (y - x * x), 1.0 - x]);
        (residuals, DMatrix::from_row_slice(2, 2, &[-20.0 * x, 10.0, -1.0, 0.0]))
    }

    fn minimum(bounds: [[f64; 2]; 2]) -> LeastSquares {
        let start = vec![-1.2, 1.0];
        let (residuals, jacobian) = rosenbrock(&start);
        let mut iterate = LeastSquares::new(bounds.to_vec(), start, residuals, jacobian);
        for _ in 0..100 {
            let step = iterate.step().expect("regular");
            let (residuals, jacobian) = rosenbrock(&step.to);
            let ratio = (iterate.sum() - residuals.norm_squared()) / step.predicted;
            if LeastSquares::accepts(ratio) {
                iterate.accept(step.to, residuals, jacobian, ratio);
            } else {
                iterate.reject(ratio);
            }
        }
        iterate
    }

    #[test]
    fn the_minimum_of_rosenbrocks_function_is_found() {
        let found = minimum([[-5.0, 5.0]; 2]);
        assert!((found.point()[0] - 1.0).abs() < 1e-9 && (found.point()[1] - 1.0).abs() < 1e-9, "{:?}", found.point());
        assert!(found.full_step().expect("regular").predicted < 1e-15);
    }

    /// Of 700 rows, the last four columns act in a quarter each.
    #[test]
    fn factors_of_chunks_are_those_of_the_whole_matrix() {
        let slope = |i: usize, j: usize| match j {
            0 | 1 => math::sin((1 + j) as f64 * i as f64),
            _ if i / 175 == j - 2 => math::cos(i as f64),
            _ => 0.0,
        };
        let jacobian = DMatrix::from_fn(700, 6, slope);
        let residuals = DVector::from_fn(700, |i, _| math::sin(0.1 * i as f64));
        let [(chunks, q), (whole, p)] =
            [factorised_by_chunks(&residuals, &jacobian), factorised_at_once(&residuals, &jacobian)];
        // Both are unique up to signs: R'R = J'J and R'Q'r = J'r.
        assert!((chunks.tr_mul(&chunks) - whole.tr_mul(&whole)).abs().max() < 1e-11);
        assert!((chunks.tr_mul(&q) - whole.tr_mul(&p)).abs().max() < 1e-11);
        assert!((chunks.tr_mul(&chunks) - jacobian.tr_mul(&jacobian)).abs().max() < 1e-11);
    }

    #[test]
    fn a_bound_in_front_of_the_minimum_holds_its_coordinate() {
        // With x at most 0.5: the minimum is at x = 0.5, y = 0.25.
        let found = minimum([[-5.0, 0.5], [-5.0, 5.0]]);
        assert!((found.point()[0] - 0.5).abs() < 1e-9 && (found.point()[1] - 0.25).abs() < 1e-9, "{:?}", found.point());
        assert!(found.largest_cosine() < 1e-9);
    }
}
