//! Quadratic models of the criteria through the points around the best one.

use mops_math as math;
use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut};

use super::sample_set::SampleSet;
use crate::active_set::dot;
use crate::cholesky::with_cholesky;

/// Cost of squared misfit, relative to squared curvature over the trust region.
const RIDGE: f64 = 1e-4;

/// Models `c + g'y + y'H y / 2` of all criteria in the steps `y = (x - centre) / radius`. Memory is reused between
/// fits.
#[derive(Debug, Default)]
pub struct QuadraticModels {
    n: usize,
    criteria: usize,
    /// True if the last points determined the models.
    is_fitted: bool,
    /// Unit of the steps.
    radius: f64,
    /// `c` of every criterion.
    constants: Vec<f64>,
    /// `g` of every criterion, concatenated.
    gradients: Vec<f64>,
    /// `H` of every criterion, concatenated.
    hessians: Vec<f64>,
    workspace: Workspace,
}

/// Buffers of the fit.
#[derive(Debug, Default)]
struct Workspace {
    /// Steps to the points, concatenated.
    steps: Vec<f64>,
    /// `X = [1 y]`, column-major.
    linear: Vec<f64>,
    /// `[X F]`, then `K^-1 [X F]`, column-major.
    solved: Vec<f64>,
    /// `[c; g]` of every criterion.
    planes: Vec<f64>,
    system: Vec<f64>,
    schur: Vec<f64>,
}

impl QuadraticModels {
    /// Creates models without curvature for a number of criteria.
    pub fn new(n: usize, criteria: usize) -> Self {
        Self {
            n,
            criteria,
            is_fitted: false,
            radius: 1.0,
            constants: vec![0.0; criteria],
            gradients: vec![0.0; criteria * n],
            hessians: vec![0.0; criteria * n * n],
            workspace: Workspace::default(),
        }
    }

    /// Fits models to points around a centre, with the smallest change (in the Frobenius norm) of the Hessians. Returns
    /// false if the points do not determine the models.
    ///
    /// With `K_ij = (y_i'y_j)^2 / 2 + mu [i = j]` and `X = [1 y]`: `[K, X; X', 0] [l; c, g] = [f - y'H_0 y / 2; 0]`,
    /// and `H = H_0 + sum l_i y_i y_i'`. The small `mu` permits small misfits that would otherwise require large
    /// changes of the Hessian, as nearly coincident points do. `K` is positive definite: the system is solved with its
    /// Cholesky factor and that of `X'K^-1 X`, with values relative to those at the first point.
    ///
    /// Source: A. R. Conn, K. Scheinberg, L. N. Vicente, Introduction to Derivative-Free Optimization (SIAM 2009),
    /// section 5.3; least change: M. J. D. Powell, Mathematical Programming 100 (2004) 183-215.
    pub fn fit(&mut self, samples: &SampleSet, neighbours: &[(f64, usize)], centre: &[f64], radius: f64) -> bool {
        let (n, criteria, count) = (self.n, self.criteria, neighbours.len());
        let rescaling = math::powi(radius / self.radius, 2);
        self.hessians.iter_mut().for_each(|h| *h *= rescaling);
        self.radius = radius;
        self.is_fitted = false;
        if count <= n {
            return false;
        }
        self.workspace.steps.clear();
        for (_, i) in neighbours {
            self.workspace.steps.extend(samples.point(*i).iter().zip(centre).map(|(a, b)| (a - b) / radius));
        }
        let Workspace { steps, linear, solved, planes, system, schur } = &mut self.workspace;
        let step = |i: usize| &steps[i * n..(i + 1) * n];
        linear.clear();
        linear.resize(count, 1.0);
        for k in 0..n {
            linear.extend((0..count).map(|i| step(i)[k]));
        }
        solved.clone_from(linear);
        let first = samples.values(neighbours[0].1);
        for row in 0..criteria {
            let h = &self.hessians[row * n * n..(row + 1) * n * n];
            solved.extend(
                neighbours
                    .iter()
                    .enumerate()
                    .map(|(i, (_, j))| samples.values(*j)[row] - first[row] - 0.5 * quadratic_form(h, step(i))),
            );
        }
        let fill = |matrix: &mut DMatrix<f64>| {
            for i in 0..count {
                for j in 0..=i {
                    matrix[(i, j)] = 0.5 * math::powi(dot(step(i), step(j)), 2);
                }
                matrix[(i, i)] += RIDGE;
            }
        };
        let columns = n + 1 + criteria;
        let factor = with_cholesky(system, count, fill, |factor| {
            factor.solve_mut(&mut DMatrixViewMut::from_slice(solved, count, columns));
        });
        if factor.is_none() {
            return false;
        }
        let column = |k: usize| &linear[k * count..(k + 1) * count];
        let solved_column = |k: usize| &solved[k * count..(k + 1) * count];
        planes.clear();
        for row in 0..criteria {
            planes.extend((0..=n).map(|k| dot(column(k), solved_column(n + 1 + row))));
        }
        let fill = |matrix: &mut DMatrix<f64>| {
            for i in 0..=n {
                for j in 0..=i {
                    matrix[(i, j)] = dot(column(i), solved_column(j));
                }
            }
        };
        let factor = with_cholesky(schur, n + 1, fill, |factor| {
            factor.solve_mut(&mut DMatrixViewMut::from_slice(planes, n + 1, criteria));
        });
        if factor.is_none() {
            return false;
        }
        let (linear_part, value_part) = solved.split_at_mut((n + 1) * count);
        let linear_part = DMatrixView::from_slice(linear_part, count, n + 1);
        let mut multipliers = DMatrixViewMut::from_slice(value_part, count, criteria);
        multipliers.gemm(-1.0, &linear_part, &DMatrixView::from_slice(planes, n + 1, criteria), 1.0);
        if !planes.iter().chain(multipliers.iter()).all(|v| v.is_finite()) {
            return false;
        }
        for row in 0..criteria {
            let plane = &planes[row * (n + 1)..(row + 1) * (n + 1)];
            self.constants[row] = first[row] + plane[0];
            self.gradients[row * n..(row + 1) * n].copy_from_slice(&plane[1..]);
            let h = &mut self.hessians[row * n * n..(row + 1) * n * n];
            for (i, multiplier) in multipliers.column(row).iter().enumerate() {
                let y = step(i);
                for (column, y_j) in h.chunks_exact_mut(n).zip(y) {
                    column.iter_mut().zip(y).for_each(|(h, y_i)| *h += multiplier * y_j * y_i);
                }
            }
        }
        self.is_fitted = true;
        true
    }

    /// Returns true if the last points determined the models.
    pub fn is_fitted(&self) -> bool {
        self.is_fitted
    }

    /// Returns the steps to the interpolation points.
    pub fn steps(&self) -> impl Iterator<Item = &[f64]> {
        self.workspace.steps.chunks_exact(self.n)
    }

    /// Returns the values of all criteria at the centre.
    pub fn constants(&self) -> &[f64] {
        &self.constants
    }

    /// Computes the values of all criteria after a step.
    pub fn values(&self, y: &[f64], values: &mut Vec<f64>) {
        let value =
            |row: usize| self.constants[row] + dot(self.gradient(row), y) + 0.5 * quadratic_form(self.hessian(row), y);
        values.clear();
        values.extend((0..self.criteria).map(value));
    }

    /// Adds the gradient of a criterion after a step, times a weight.
    pub fn add_gradient(&self, row: usize, y: &[f64], weight: f64, sum: &mut [f64]) {
        // Hessians are symmetric.
        let columns = self.hessian(row).chunks_exact(self.n);
        for ((sum, gradient), column) in sum.iter_mut().zip(self.gradient(row)).zip(columns) {
            *sum += weight * (gradient + dot(column, y));
        }
    }

    /// Adds the Hessian of a criterion, times a weight.
    pub fn add_hessian(&self, row: usize, weight: f64, sum: &mut DMatrix<f64>) {
        if weight != 0.0 {
            sum.iter_mut().zip(self.hessian(row)).for_each(|(sum, h)| *sum += weight * h);
        }
    }

    fn gradient(&self, row: usize) -> &[f64] {
        &self.gradients[row * self.n..(row + 1) * self.n]
    }

    fn hessian(&self, row: usize) -> &[f64] {
        let size = self.n * self.n;
        &self.hessians[row * size..(row + 1) * size]
    }
}

/// Returns `y'H y`.
fn quadratic_form(h: &[f64], y: &[f64]) -> f64 {
    h.chunks_exact(y.len()).zip(y).map(|(column, y_j)| y_j * dot(column, y)).sum()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Fits models with centre 0 and radius 1 to values of the criteria at given steps.
    pub fn through<const N: usize>(steps: &[[f64; N]], f: impl Fn(&[f64; N]) -> Vec<f64>) -> QuadraticModels {
        let criteria = f(&steps[0]).len();
        let mut samples = SampleSet::new(N, criteria);
        steps.iter().for_each(|y| samples.insert(y, &f(y)));
        let neighbours: Vec<(f64, usize)> = (0..steps.len()).map(|i| (0.0, i)).collect();
        let mut models = QuadraticModels::new(N, criteria);
        assert!(models.fit(&samples, &neighbours, &[0.0; N], 1.0));
        models
    }

    fn value(models: &QuadraticModels, y: &[f64]) -> f64 {
        let mut values = Vec::new();
        models.values(y, &mut values);
        values[0]
    }

    #[test]
    fn enough_points_reproduce_a_quadratic() {
        let f = |y: &[f64; 2]| vec![1.0 + 2.0 * y[0] - y[1] + 3.0 * y[0] * y[0] + y[0] * y[1] - 0.5 * y[1] * y[1]];
        let models = through(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [0.7, 0.6]], f);
        let y = [0.3, -0.8];
        assert!((value(&models, &y) - f(&y)[0]).abs() < 1e-3);
        let mut gradient = [0.0; 2];
        models.add_gradient(0, &y, 1.0, &mut gradient);
        assert!((gradient[0] - (2.0 + 6.0 * 0.3 - 0.8)).abs() < 1e-3);
        assert!((gradient[1] - (-1.0 + 0.3 + 0.8)).abs() < 1e-3);
    }

    #[test]
    fn few_points_give_a_plane() {
        let models = through(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], |y| vec![1.0 + 2.0 * y[0] - y[1]]);
        assert!((value(&models, &[2.0, 2.0]) - 3.0).abs() < 1e-3);
    }

    #[test]
    fn points_on_a_line_determine_no_plane() {
        let mut samples = SampleSet::new(2, 1);
        [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]].iter().for_each(|y| samples.insert(y, &[y[0]]));
        let neighbours = [(0.0, 0), (0.5, 1), (1.0, 2)];
        assert!(!QuadraticModels::new(2, 1).fit(&samples, &neighbours, &[0.0, 0.0], 1.0));
        assert!(!QuadraticModels::new(2, 1).fit(&samples, &neighbours[..2], &[0.0, 0.0], 1.0));
    }

    #[test]
    fn curvature_is_kept_for_few_points_at_any_radius() {
        let f = |y: &[f64; 1]| vec![3.0 * y[0] * y[0]];
        let mut models = through(&[[0.0], [1.0], [-1.0]], f);
        let mut samples = SampleSet::new(1, 1);
        [[0.5], [0.6]].iter().for_each(|y| samples.insert(y, &f(y)));
        assert!(models.fit(&samples, &[(0.0, 0), (0.0, 1)], &[0.5], 0.1));
        let mut hessian = DMatrix::zeros(1, 1);
        models.add_hessian(0, 1.0, &mut hessian);
        assert!((hessian[(0, 0)] - 0.06).abs() < 1e-4, "{hessian}");
        assert!((value(&models, &[2.0]) - 3.0 * 0.7 * 0.7).abs() < 1e-3);
    }
}
