//! Normal distribution of CMA-ES and its update from a ranked generation.

use mops_math as math;
use mops_math::Stream;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::strategy::Strategy;

/// Distribution `N(mean, sigma^2 C)` with `C = B D^2 B'`, its evolution paths and constants.
#[derive(Debug, Clone)]
pub struct Distribution {
    /// Strategy constants.
    pub strategy: Strategy,
    /// Mean; it may lie outside the box.
    pub mean: DVector<f64>,
    /// Overall standard deviation.
    pub sigma: f64,
    /// Number of generations so far.
    pub generation: usize,
    covariance: DMatrix<f64>,
    /// Eigenvectors `B` of the covariance matrix, one per column.
    eigenvectors: DMatrix<f64>,
    /// Square roots `D` of the eigenvalues.
    deviations: DVector<f64>,
    path_sigma: DVector<f64>,
    path_c: DVector<f64>,
    /// Generation of the last eigendecomposition.
    decomposed_at: usize,
    /// Minimum standard deviation of every coordinate, so that steps still reach the next value of a grid.
    min_deviation: Vec<f64>,
}

impl Distribution {
    /// Creates an isotropic distribution; `min_deviation` is the minimum standard deviation of every coordinate.
    pub fn new(mean: Vec<f64>, sigma: f64, population: usize, min_deviation: Vec<f64>) -> Self {
        let n = mean.len();
        Self {
            strategy: Strategy::new(n, population),
            mean: DVector::from_vec(mean),
            sigma,
            generation: 0,
            covariance: DMatrix::identity(n, n),
            eigenvectors: DMatrix::identity(n, n),
            deviations: DVector::from_element(n, 1.0),
            path_sigma: DVector::zeros(n),
            path_c: DVector::zeros(n),
            decomposed_at: 0,
            min_deviation,
        }
    }

    /// Samples the steps `y = B D z` of a generation, one per column; a member is `mean + sigma y`.
    pub fn sample(&self, random: &mut Stream) -> DMatrix<f64> {
        let mut z = DMatrix::from_fn(self.mean.len(), self.strategy.population, |_, _| math::normal(random));
        for mut column in z.column_iter_mut() {
            column.component_mul_assign(&self.deviations);
        }
        &self.eigenvectors * z
    }

    /// Updates the distribution with a generation's steps; `order` lists the indices of the members, the best first.
    ///
    /// Source: N. Hansen, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772, equations 38 to 47 (with negative
    /// weights).
    #[allow(clippy::cast_precision_loss)]
    pub fn update(&mut self, steps: &DMatrix<f64>, order: &[usize]) {
        let Strategy { parents, effective, c_sigma, d_sigma, c_c, c_1, c_mu, chi, .. } = self.strategy;
        let n = self.mean.len() as f64;
        self.generation += 1;
        // Equations 41 and 42: the mean.
        let mut mean_step = DVector::zeros(self.mean.len());
        for (weight, &member) in self.strategy.weights[..parents].iter().zip(order) {
            mean_step.axpy(*weight, &steps.column(member), 1.0);
        }
        self.mean.axpy(self.sigma, &mean_step, 1.0);
        // Equations 43 and 44: the step size.
        let whitened = self.whiten(&mean_step);
        self.path_sigma *= 1.0 - c_sigma;
        self.path_sigma.axpy((c_sigma * (2.0 - c_sigma) * effective).sqrt(), &whitened, 1.0);
        let length = self.path_sigma.norm();
        self.sigma *= math::exp(((c_sigma / d_sigma) * (length / chi - 1.0)).min(1.0));
        // Equations 45 to 47: the covariance.
        #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)]
        let path_correction = 1.0 - math::powi(1.0 - c_sigma, 2 * (self.generation as i32 + 1));
        let path_is_short = length / path_correction.sqrt() < (1.4 + 2.0 / (n + 1.0)) * chi;
        self.path_c *= 1.0 - c_c;
        if path_is_short {
            self.path_c.axpy((c_c * (2.0 - c_c) * effective).sqrt(), &mean_step, 1.0);
        }
        let compensation = if path_is_short { 0.0 } else { c_1 * c_c * (2.0 - c_c) };
        self.covariance *= 1.0 + compensation - c_1 - c_mu * self.strategy.weights.iter().sum::<f64>();
        self.covariance.ger(c_1, &self.path_c, &self.path_c, 1.0);
        for (&weight, &member) in self.strategy.weights.iter().zip(order) {
            let step = steps.column(member);
            // The squared norm of `C^(-1/2) y`.
            let along =
                self.eigenvectors.column_iter().zip(&self.deviations).map(|(axis, length)| axis.dot(&step) / length);
            let square = || along.map(|z| z * z).sum::<f64>().max(f64::MIN_POSITIVE);
            let weight = if weight >= 0.0 { weight } else { weight * n / square() };
            self.covariance.ger(c_mu * weight, &step, &step, 1.0);
        }
        self.enforce_min_deviation();
        let decomposition_interval = 1.0 / (10.0 * n * (c_1 + c_mu));
        if (self.generation - self.decomposed_at) as f64 > decomposition_interval {
            self.decompose();
        }
    }

    /// Computes `C^(-1/2) y`.
    fn whiten(&self, y: &DVector<f64>) -> DVector<f64> {
        let mut along = self.eigenvectors.tr_mul(y);
        along.component_div_assign(&self.deviations);
        &self.eigenvectors * along
    }

    fn enforce_min_deviation(&mut self) {
        for j in 0..self.min_deviation.len() {
            let deviation = self.sigma * self.covariance[(j, j)].sqrt();
            if deviation < self.min_deviation[j] {
                let factor = self.min_deviation[j] / deviation;
                self.covariance.row_mut(j).scale_mut(factor);
                self.covariance.column_mut(j).scale_mut(factor);
            }
        }
    }

    fn decompose(&mut self) {
        self.decomposed_at = self.generation;
        self.covariance = (&self.covariance + self.covariance.transpose()) * 0.5;
        let eigen = SymmetricEigen::new(self.covariance.clone());
        let largest = eigen.eigenvalues.max();
        if !largest.is_finite() || largest <= 0.0 {
            self.covariance = DMatrix::identity(self.mean.len(), self.mean.len());
            self.eigenvectors = self.covariance.clone();
            self.deviations.fill(1.0);
            return;
        }
        self.deviations = eigen.eigenvalues.map(|value| value.max(1e-20 * largest).sqrt());
        self.eigenvectors = eigen.eigenvectors;
    }

    /// Returns the condition number of the covariance matrix.
    pub fn condition(&self) -> f64 {
        math::powi(self.deviations.max() / self.deviations.min(), 2)
    }

    /// Returns the larger of two extents: the largest standard deviation of a coordinate, and `sigma` times the largest
    /// entry of the evolution path of the covariance.
    pub fn largest_extent(&self) -> f64 {
        let spread = self.covariance.diagonal().map(f64::sqrt).max();
        self.sigma * spread.max(self.path_c.amax())
    }

    /// Returns true if steps are below rounding: a tenth of a standard deviation along a principal axis, or a fifth
    /// along a coordinate, leaves the mean unchanged.
    pub fn is_below_rounding(&self) -> bool {
        let axis = self.generation % self.mean.len();
        let step = self.eigenvectors.column(axis) * (0.1 * self.sigma * self.deviations[axis]);
        let along_axis = self.mean.iter().zip(step.iter()).all(|(m, s)| m + s == *m);
        let spread = self.covariance.diagonal();
        along_axis || self.mean.iter().zip(spread.iter()).any(|(m, c)| *m == m + 0.2 * self.sigma * c.sqrt())
    }
}
