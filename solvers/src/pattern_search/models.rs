//! A quadratic model of every row through the points around the best one.

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut};

use super::known::Known;
use crate::active_set::dot;
use crate::definite::factored;
use mops_core::math;

/// What a unit of squared misfit costs, in units of squared curvature over the trust region.
const MISS: f64 = 1e-4;

/// Models `c + g'y + y'H y / 2` of all rows in the steps `y = (x - centre) / radius`. They are fitted again and again; memory
/// once asked for is kept.
#[derive(Debug, Default)]
pub struct Models {
    n: usize,
    rows: usize,
    /// Whether the last points determined them.
    are_fitted: bool,
    /// The unit of steps.
    radius: f64,
    /// `c` of every row.
    constants: Vec<f64>,
    /// `g` of every row, one after the other.
    slopes: Vec<f64>,
    /// `H` of every row, one after the other.
    curvatures: Vec<f64>,
    room: Room,
}

/// What is needed while models are fitted.
#[derive(Debug, Default)]
struct Room {
    /// The steps to the points, one after the other.
    steps: Vec<f64>,
    /// `X = [1 y]`, by columns.
    linear: Vec<f64>,
    /// `[X F]`, then `K^-1 [X F]`, by columns.
    solved: Vec<f64>,
    /// `[c; g]` of every row.
    planes: Vec<f64>,
    system: Vec<f64>,
    schur: Vec<f64>,
}

impl Models {
    /// Models of so many rows without any curvature.
    pub fn new(n: usize, rows: usize) -> Self {
        Self {
            n,
            rows,
            are_fitted: false,
            radius: 1.0,
            constants: vec![0.0; rows],
            slopes: vec![0.0; rows * n],
            curvatures: vec![0.0; rows * n * n],
            room: Room::default(),
        }
    }

    /// Lays models through points around a centre, whose curvatures differ least (in the Frobenius norm) from the ones before;
    /// `false` where the points do not determine them.
    ///
    /// With `K_ij = (y_i'y_j)^2 / 2 + mu [i = j]` and `X = [1 y]`: `[K, X; X', 0] [l; c, g] = [f - y'H_0 y / 2; 0]`, and
    /// `H = H_0 + sum l_i y_i y_i'`. The small `mu` lets the models miss values by as little as the curvature would have to
    /// change much for: points that nearly coincide would bend them beyond reason. `K` is positive definite, so that the
    /// system is solved by its factor and that of `X'K^-1 X`, with values measured from those at the first point.
    ///
    /// Source: A. R. Conn, K. Scheinberg, L. N. Vicente, Introduction to Derivative-Free Optimization (SIAM 2009), section
    /// 5.3; least change: M. J. D. Powell, Mathematical Programming 100 (2004) 183-215.
    pub fn fit(&mut self, known: &Known, near: &[(f64, usize)], centre: &[f64], radius: f64) -> bool {
        let (n, rows, count) = (self.n, self.rows, near.len());
        let unit = math::powi(radius / self.radius, 2);
        self.curvatures.iter_mut().for_each(|h| *h *= unit);
        self.radius = radius;
        self.are_fitted = false;
        if count <= n {
            return false;
        }
        self.room.steps.clear();
        for (_, i) in near {
            self.room.steps.extend(known.point(*i).iter().zip(centre).map(|(a, b)| (a - b) / radius));
        }
        let Room { steps, linear, solved, planes, system, schur } = &mut self.room;
        let step = |i: usize| &steps[i * n..(i + 1) * n];
        linear.clear();
        linear.resize(count, 1.0);
        for k in 0..n {
            linear.extend((0..count).map(|i| step(i)[k]));
        }
        solved.clone_from(linear);
        let first = known.values(near[0].1);
        for row in 0..rows {
            let h = &self.curvatures[row * n * n..(row + 1) * n * n];
            solved.extend(
                near.iter().enumerate().map(|(i, (_, j))| known.values(*j)[row] - first[row] - 0.5 * form(h, step(i))),
            );
        }
        let fill = |matrix: &mut DMatrix<f64>| {
            for i in 0..count {
                for j in 0..=i {
                    matrix[(i, j)] = 0.5 * math::powi(dot(step(i), step(j)), 2);
                }
                matrix[(i, i)] += MISS;
            }
        };
        let all = n + 1 + rows;
        let factor = factored(system, count, fill, |factor| {
            factor.solve_mut(&mut DMatrixViewMut::from_slice(solved, count, all));
        });
        if factor.is_none() {
            return false;
        }
        let column = |k: usize| &linear[k * count..(k + 1) * count];
        let of_solved = |k: usize| &solved[k * count..(k + 1) * count];
        planes.clear();
        for row in 0..rows {
            planes.extend((0..=n).map(|k| dot(column(k), of_solved(n + 1 + row))));
        }
        let fill = |matrix: &mut DMatrix<f64>| {
            for i in 0..=n {
                for j in 0..=i {
                    matrix[(i, j)] = dot(column(i), of_solved(j));
                }
            }
        };
        let factor = factored(schur, n + 1, fill, |factor| {
            factor.solve_mut(&mut DMatrixViewMut::from_slice(planes, n + 1, rows));
        });
        if factor.is_none() {
            return false;
        }
        let (of_linear, of_values) = solved.split_at_mut((n + 1) * count);
        let of_linear = DMatrixView::from_slice(of_linear, count, n + 1);
        let mut multipliers = DMatrixViewMut::from_slice(of_values, count, rows);
        multipliers.gemm(-1.0, &of_linear, &DMatrixView::from_slice(planes, n + 1, rows), 1.0);
        if !planes.iter().chain(multipliers.iter()).all(|v| v.is_finite()) {
            return false;
        }
        for row in 0..rows {
            let found = &planes[row * (n + 1)..(row + 1) * (n + 1)];
            self.constants[row] = first[row] + found[0];
            self.slopes[row * n..(row + 1) * n].copy_from_slice(&found[1..]);
            let h = &mut self.curvatures[row * n * n..(row + 1) * n * n];
            for (i, multiplier) in multipliers.column(row).iter().enumerate() {
                let y = step(i);
                for (column, y_j) in h.chunks_exact_mut(n).zip(y) {
                    column.iter_mut().zip(y).for_each(|(h, y_i)| *h += multiplier * y_j * y_i);
                }
            }
        }
        self.are_fitted = true;
        true
    }

    /// Whether the last points determined them.
    pub fn are_fitted(&self) -> bool {
        self.are_fitted
    }

    /// The steps to the points that the models go through.
    pub fn steps(&self) -> impl Iterator<Item = &[f64]> {
        self.room.steps.chunks_exact(self.n)
    }

    /// Values of all rows without a step.
    pub fn constants(&self) -> &[f64] {
        &self.constants
    }

    /// Values of all rows after a step.
    pub fn values(&self, y: &[f64], values: &mut Vec<f64>) {
        let value = |row: usize| self.constants[row] + dot(self.slope(row), y) + 0.5 * form(self.curvature(row), y);
        values.clear();
        values.extend((0..self.rows).map(value));
    }

    /// Adds the slope of a row after a step, times a weight.
    pub fn add_slope(&self, row: usize, y: &[f64], weight: f64, sum: &mut [f64]) {
        // Curvatures are symmetric.
        let columns = self.curvature(row).chunks_exact(self.n);
        for ((sum, slope), column) in sum.iter_mut().zip(self.slope(row)).zip(columns) {
            *sum += weight * (slope + dot(column, y));
        }
    }

    /// Adds the curvature of a row, times a weight.
    pub fn add_curvature(&self, row: usize, weight: f64, sum: &mut DMatrix<f64>) {
        if weight != 0.0 {
            sum.iter_mut().zip(self.curvature(row)).for_each(|(sum, h)| *sum += weight * h);
        }
    }

    fn slope(&self, row: usize) -> &[f64] {
        &self.slopes[row * self.n..(row + 1) * self.n]
    }

    fn curvature(&self, row: usize) -> &[f64] {
        let size = self.n * self.n;
        &self.curvatures[row * size..(row + 1) * size]
    }
}

/// `y'H y`.
fn form(h: &[f64], y: &[f64]) -> f64 {
    h.chunks_exact(y.len()).zip(y).map(|(column, y_j)| y_j * dot(column, y)).sum()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Models in steps from 0, of radius 1, through values of rows at given steps.
    pub fn through<const N: usize>(steps: &[[f64; N]], f: impl Fn(&[f64; N]) -> Vec<f64>) -> Models {
        let rows = f(&steps[0]).len();
        let mut known = Known::new(N, rows);
        steps.iter().for_each(|y| known.remember(y, &f(y)));
        let near: Vec<(f64, usize)> = (0..steps.len()).map(|i| (0.0, i)).collect();
        let mut models = Models::new(N, rows);
        assert!(models.fit(&known, &near, &[0.0; N], 1.0));
        models
    }

    fn value(models: &Models, y: &[f64]) -> f64 {
        let mut values = Vec::new();
        models.values(y, &mut values);
        values[0]
    }

    #[test]
    fn enough_points_give_a_quadratic_back() {
        let f = |y: &[f64; 2]| vec![1.0 + 2.0 * y[0] - y[1] + 3.0 * y[0] * y[0] + y[0] * y[1] - 0.5 * y[1] * y[1]];
        let models = through(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [0.7, 0.6]], f);
        let y = [0.3, -0.8];
        assert!((value(&models, &y) - f(&y)[0]).abs() < 1e-3);
        let mut slope = [0.0; 2];
        models.add_slope(0, &y, 1.0, &mut slope);
        assert!((slope[0] - (2.0 + 6.0 * 0.3 - 0.8)).abs() < 1e-3);
        assert!((slope[1] - (-1.0 + 0.3 + 0.8)).abs() < 1e-3);
    }

    #[test]
    fn few_points_give_a_plane() {
        let models = through(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], |y| vec![1.0 + 2.0 * y[0] - y[1]]);
        assert!((value(&models, &[2.0, 2.0]) - 3.0).abs() < 1e-3);
    }

    #[test]
    fn points_on_a_line_determine_no_plane() {
        let mut known = Known::new(2, 1);
        [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]].iter().for_each(|y| known.remember(y, &[y[0]]));
        let near = [(0.0, 0), (0.5, 1), (1.0, 2)];
        assert!(!Models::new(2, 1).fit(&known, &near, &[0.0, 0.0], 1.0));
        assert!(!Models::new(2, 1).fit(&known, &near[..2], &[0.0, 0.0], 1.0));
    }

    #[test]
    fn curvature_is_kept_where_few_points_tell_of_it_whatever_the_radius() {
        let f = |y: &[f64; 1]| vec![3.0 * y[0] * y[0]];
        let mut models = through(&[[0.0], [1.0], [-1.0]], f);
        let mut known = Known::new(1, 1);
        [[0.5], [0.6]].iter().for_each(|y| known.remember(y, &f(y)));
        assert!(models.fit(&known, &[(0.0, 0), (0.0, 1)], &[0.5], 0.1));
        let mut curvature = DMatrix::zeros(1, 1);
        models.add_curvature(0, 1.0, &mut curvature);
        assert!((curvature[(0, 0)] - 0.06).abs() < 1e-4, "{curvature}");
        assert!((value(&models, &[2.0]) - 3.0 * 0.7 * 0.7).abs() < 1e-3);
    }
}
