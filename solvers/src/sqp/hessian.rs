//! The curvature of the Lagrangian, from the slopes at the two ends of a step.

use nalgebra::{DMatrix, DVector, DVectorView};

/// A damped BFGS matrix: positive definite whatever the curvature.
///
/// Source: M. J. D. Powell, in Numerical Analysis Dundee 1977, Lecture Notes in Mathematics 630 (damping); J. Nocedal,
/// S. Wright, Numerical Optimization, 2nd edition (2006), equation 6.20 (first scale).
#[derive(Debug)]
pub(super) struct Hessian {
    matrix: DMatrix<f64>,
    /// Curvature before anything is known.
    first: f64,
    /// Whether it has seen a step yet.
    learned: bool,
    /// `B s`.
    bs: DVector<f64>,
    /// The damped change of the slope.
    damped: DVector<f64>,
}

/// Curvature along a step that is left at least, as a share of what was there. N.B.: Powell takes 0.2.
const DAMPED: f64 = 0.1;

/// Curvature in the unit box beyond which a change of slope is taken for a kink.
const LARGEST: f64 = 1e7;

impl Hessian {
    /// Before anything is known, where the steepest objective has a slope of about 1: one objective alone is followed for
    /// about a tenth of the box; several hold the step where they meet.
    pub fn new(n: usize, objectives: usize) -> Self {
        let first = if objectives > 1 { 1.0 } else { 10.0 };
        let [bs, damped] = [DVector::zeros(n), DVector::zeros(n)];
        Self { matrix: DMatrix::identity(n, n) * first, first, learned: false, bs, damped }
    }

    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }

    /// Whether it has seen a step yet.
    pub fn has_learned(&self) -> bool {
        self.learned
    }

    /// Forgets all it has seen.
    pub fn forget(&mut self) {
        self.matrix.fill_with_identity();
        self.matrix *= self.first;
        self.learned = false;
    }

    /// `1/2 d'Bd`.
    pub fn half(&self, step: &[f64]) -> f64 {
        let n = step.len();
        let along = |j: usize| (0..n).map(|i| self.matrix[(i, j)] * step[i]).sum::<f64>();
        0.5 * (0..n).map(|j| along(j) * step[j]).sum::<f64>()
    }

    /// Takes in a step and the change of the Lagrangian's slope along it.
    pub fn learn(&mut self, s: &[f64], y: &[f64]) {
        let n = s.len();
        let (s, y) = (DVectorView::from_slice(s, n), DVectorView::from_slice(y, n));
        // Across a kink or a jump the slopes change at once: that is no curvature.
        if s.norm() < 1e-12 || y.norm() > LARGEST * s.norm() {
            return;
        }
        if !self.learned {
            let scale = if s.dot(&y) > 0.0 { y.norm_squared() / s.dot(&y) } else { self.first };
            self.matrix.fill_with_identity();
            self.matrix *= scale.clamp(1e-2, 1e4);
            self.learned = true;
        }
        let Self { matrix, bs, damped, .. } = self;
        bs.gemv(1.0, matrix, &s, 0.0);
        let sbs = s.dot(bs);
        let sy = s.dot(&y);
        let theta = if sy >= DAMPED * sbs { 1.0 } else { (1.0 - DAMPED) * sbs / (sbs - sy) };
        damped.zip_zip_apply(&y, bs, |r, y, bs| *r = y * theta + bs * (1.0 - theta));
        matrix.ger(1.0 / s.dot(damped), damped, damped, 1.0);
        matrix.ger(-1.0 / sbs, bs, bs, 1.0);
        if matrix.iter().any(|h| !h.is_finite() || h.abs() > 1e9) {
            self.forget();
        }
    }
}
