//! Hessian of the Lagrangian, approximated from the gradients at both ends of a step.

use nalgebra::{DMatrix, DVector, DVectorView};

/// Damped BFGS matrix, positive definite for any curvature.
///
/// Source: M. J. D. Powell, in Numerical Analysis Dundee 1977, Lecture Notes in Mathematics 630 (damping); J. Nocedal,
/// S. Wright, Numerical Optimization, 2nd edition (2006), equation 6.20 (initial scale).
#[derive(Debug)]
pub(super) struct Hessian {
    matrix: DMatrix<f64>,
    /// Initial curvature.
    initial: f64,
    /// True once a step has been taken into account.
    has_curvature: bool,
    /// Product `B s`.
    bs: DVector<f64>,
    /// Damped change of the gradient.
    damped_change: DVector<f64>,
}

/// Smallest curvature along a step after damping, relative to the previous curvature. N.B.: Powell uses 0.2.
const DAMPING_THRESHOLD: f64 = 0.1;

/// Curvature in the unit box above which a change of the gradient is attributed to a kink.
const MAX_CURVATURE: f64 = 1e7;

impl Hessian {
    /// Creates the initial matrix, for gradients with largest entry of about 1. For a single objective, it limits the
    /// first step to about a tenth of the box. Several objectives limit the step where they intersect.
    pub fn new(n: usize, objectives: usize) -> Self {
        let initial = if objectives > 1 { 1.0 } else { 10.0 };
        let [bs, damped_change] = [DVector::zeros(n), DVector::zeros(n)];
        Self { matrix: DMatrix::identity(n, n) * initial, initial, has_curvature: false, bs, damped_change }
    }

    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// Returns true once a step has been taken into account.
    pub fn has_curvature(&self) -> bool {
        self.has_curvature
    }

    /// Resets the matrix to its initial value.
    pub fn reset(&mut self) {
        self.matrix.fill_with_identity();
        self.matrix *= self.initial;
        self.has_curvature = false;
    }

    /// Returns `1/2 d'Bd`.
    pub fn half_quadratic_form(&self, step: &[f64]) -> f64 {
        let n = step.len();
        let along = |j: usize| (0..n).map(|i| self.matrix[(i, j)] * step[i]).sum::<f64>();
        0.5 * (0..n).map(|j| along(j) * step[j]).sum::<f64>()
    }

    /// Updates the matrix with a step and the change of the Lagrangian's gradient along it.
    pub fn update(&mut self, s: &[f64], y: &[f64]) {
        let n = s.len();
        let (s, y) = (DVectorView::from_slice(s, n), DVectorView::from_slice(y, n));
        // The jump of the gradient across a kink or discontinuity is not curvature.
        if s.norm() < 1e-12 || y.norm() > MAX_CURVATURE * s.norm() {
            return;
        }
        if !self.has_curvature {
            let scale = if s.dot(&y) > 0.0 { y.norm_squared() / s.dot(&y) } else { self.initial };
            self.matrix.fill_with_identity();
            self.matrix *= scale.clamp(1e-2, 1e4);
            self.has_curvature = true;
        }
        let Self { matrix, bs, damped_change, .. } = self;
        bs.gemv(1.0, matrix, &s, 0.0);
        let sbs = s.dot(bs);
        let sy = s.dot(&y);
        let theta = if sy >= DAMPING_THRESHOLD * sbs { 1.0 } else { (1.0 - DAMPING_THRESHOLD) * sbs / (sbs - sy) };
        damped_change.zip_zip_apply(&y, bs, |r, y, bs| *r = y * theta + bs * (1.0 - theta));
        matrix.ger(1.0 / s.dot(damped_change), damped_change, damped_change, 1.0);
        matrix.ger(-1.0 / sbs, bs, bs, 1.0);
        if matrix.iter().any(|h| !h.is_finite() || h.abs() > 1e9) {
            self.reset();
        }
    }
}
