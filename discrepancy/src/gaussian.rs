//! A Gaussian signal behind residuals: how large it is by its marginal likelihood, its most probable course, and how many
//! degrees of freedom it takes.
//!
//! Source: D. MacKay, Bayesian interpolation, Neural Computation 4 (1992) 415 (evidence, effective number of parameters); C. Rasmussen,
//! C. Williams, Gaussian Processes for Machine Learning (2006), equation 4.17 (Matern covariance) and section 5.4.

use mops_math as math;
use nalgebra::linalg::SymmetricTridiagonal;
use nalgebra::{DMatrix, DVector};

/// Residuals `r` and columns `F`, both without what the unknowns absorb: the residuals are `-F c` and white noise of size 1.
pub struct Normals {
    /// `F' F`.
    pub gram: DMatrix<f64>,
    /// `-F' r`.
    pub pull: DVector<f64>,
    /// `r' r`.
    pub chi2: f64,
    /// Number of residuals less that of the directions taken out.
    pub freedom: f64,
}

/// What is expected of the coefficients `c` of some of the columns: normal, with covariance `variance R R'`.
pub struct Prior {
    /// The columns.
    pub columns: Vec<usize>,
    /// `R`.
    pub root: DMatrix<f64>,
}

/// The likeliest variance under a prior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likeliest {
    /// Logarithm of the marginal likelihood over that without the signal, at least 0.
    pub evidence: f64,
    /// The variance; 0 where no signal is likelier than none.
    pub variance: f64,
}

/// The most probable coefficients.
pub struct Estimate {
    /// The coefficients of all columns; 0 for those that the prior leaves out.
    pub coefficients: DVector<f64>,
    /// Effective degrees of freedom.
    pub freedom: f64,
}

impl Normals {
    /// `R' G R` and `R' p`.
    fn whitened(&self, prior: &Prior) -> (DMatrix<f64>, DVector<f64>) {
        let at = &prior.columns;
        let gram = DMatrix::from_fn(at.len(), at.len(), |i, j| self.gram[(at[i], at[j])]);
        let pull = DVector::from_fn(at.len(), |i, _| self.pull[at[i]]);
        let turned = prior.root.transpose();
        (&turned * gram * &prior.root, turned * pull)
    }

    /// The likeliest variance. The noise is of size 1 or larger, whichever is likelier, so that a signal need not stand for
    /// what no signal at its place explains.
    pub fn likeliest(&self, prior: &Prior) -> Likeliest {
        let none = Likeliest { evidence: 0.0, variance: 0.0 };
        let (matrix, pull) = self.whitened(prior);
        let trace = matrix.trace();
        if !(trace.is_finite() && trace > 0.0 && pull.iter().all(|p| p.is_finite())) {
            return none;
        }
        let (diagonal, off, pull) = if matrix.nrows() == 1 {
            (matrix.diagonal(), DVector::zeros(0), pull)
        } else {
            let (q, diagonal, off) = SymmetricTridiagonal::new(matrix).unpack();
            (diagonal, off, q.tr_mul(&pull))
        };
        let of = |exponent: f64| self.likelihood(&diagonal, &off, &pull, math::powf(10.0, exponent) / trace);
        let rest = self.likelihood(&diagonal, &off, &pull, 0.0);
        let grid = (-4..=24).map(|k| 0.5 * f64::from(k)).map(|e| (e, of(e)));
        let Some((mut best, mut value)) = grid.max_by(|a, b| a.1.total_cmp(&b.1)) else { return none };
        for step in [0.25, 0.12, 0.06, 0.03] {
            for exponent in [best - step, best + step] {
                let trial = of(exponent);
                if trial > value {
                    (best, value) = (exponent, trial);
                }
            }
        }
        let evidence = value - rest;
        if evidence > 0.0 { Likeliest { evidence, variance: math::powf(10.0, best) / trace } } else { none }
    }

    /// Logarithm of the marginal likelihood up to a constant, the matrix given as a tridiagonal one.
    fn likelihood(&self, diagonal: &DVector<f64>, off: &DVector<f64>, pull: &DVector<f64>, variance: f64) -> f64 {
        let (mut determinant, mut explained) = (0.0, 0.0);
        let (mut pivot, mut left) = (1.0, 0.0);
        for k in 0..diagonal.len() {
            let beside = if k == 0 { 0.0 } else { variance * off[k - 1] };
            let factor = beside / pivot;
            left = pull[k] - factor * left;
            pivot = 1.0 + variance * diagonal[k] - factor * beside;
            if pivot <= 0.0 {
                return f64::NEG_INFINITY;
            }
            determinant += math::ln(pivot);
            explained += left * left / pivot;
        }
        let rest = (self.chi2 - variance * explained).max(0.0);
        let noise = (rest / self.freedom.max(1.0)).max(1.0);
        -0.5 * (determinant + self.freedom * math::ln(noise) + rest / noise)
    }

    /// The most probable coefficients under a prior of this variance; `None` where they cannot be told apart.
    pub fn estimate(&self, prior: &Prior, variance: f64) -> Option<Estimate> {
        let (matrix, pull) = self.whitened(prior);
        let size = matrix.nrows();
        let inverse = (DMatrix::identity(size, size) + matrix * variance).cholesky()?;
        let chosen = &prior.root * inverse.solve(&pull) * variance;
        let mut coefficients = DVector::zeros(self.pull.len());
        prior.columns.iter().zip(chosen.iter()).for_each(|(&k, &c)| coefficients[k] = c);
        #[allow(clippy::cast_precision_loss)]
        let freedom = size as f64 - inverse.inverse().trace();
        Some(Estimate { coefficients, freedom })
    }
}

/// A root of the Matern 3/2 covariance `(1 + d) exp(-d)`, `d = sqrt(3) |x - x'|/length`, between points.
pub fn matern(points: &[f64], length: f64) -> Option<DMatrix<f64>> {
    let n = points.len();
    let covariance = DMatrix::from_fn(n, n, |i, j| {
        let d = 3.0_f64.sqrt() * (points[i] - points[j]).abs() / length;
        (1.0 + d) * math::exp(-d) + if i == j { 1e-9 } else { 0.0 }
    });
    Some(covariance.cholesky()?.unpack())
}

/// Roots of independent parts, one after the other, each times a factor.
pub fn joined(parts: &[(f64, &DMatrix<f64>)]) -> DMatrix<f64> {
    let size = parts.iter().map(|(_, root)| root.nrows()).sum();
    let mut all = DMatrix::zeros(size, size);
    let mut at = 0;
    for (factor, root) in parts {
        let n = root.nrows();
        all.view_mut((at, at), (n, n)).copy_from(&(*root * *factor));
        at += n;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_column_has_the_evidence_and_the_estimate_of_the_textbook() {
        // y = c x + noise, x'x = 4, x'y = 10, y'y = 40, 30 samples, c ~ N(0, v): y ~ N(0, I + v x x').
        let (square, product, chi2): (f64, f64, f64) = (4.0, 10.0, 28.0);
        let normals = Normals {
            gram: DMatrix::from_element(1, 1, square),
            pull: DVector::from_element(1, product),
            chi2,
            freedom: 30.0,
        };
        let prior = Prior { columns: vec![0], root: DMatrix::from_element(1, 1, 1.0) };
        let found = normals.likeliest(&prior);
        // Stationary where 1 + v x'x = (x'y)^2/x'x, here 25: v = 6, ln L = (25 - 1)/2 - ln(25)/2.
        assert!((found.variance / 6.0 - 1.0).abs() < 0.1, "{found:?}");
        assert!((found.evidence - (12.0 - 0.5 * math::ln(25.0))).abs() < 1e-2, "{found:?}");
        let estimate = normals.estimate(&prior, 6.0).expect("it is regular");
        assert!((estimate.coefficients[0] - 6.0 * 10.0 / 25.0).abs() < 1e-12);
        assert!((estimate.freedom - 24.0 / 25.0).abs() < 1e-12);
    }

    #[test]
    fn a_tridiagonal_likelihood_is_that_of_the_full_covariance() {
        // Seven residuals, three columns, against the density of N(0, I + v F K F') written out.
        let columns = DMatrix::from_fn(7, 3, |i, j| math::sin(0.7 + 1.3 * i as f64 + 2.1 * (i * j) as f64));
        let residuals = DVector::from_fn(7, |i, _| math::cos(0.4 * i as f64) * 0.9);
        let root = matern(&[0.0, 0.3, 1.0], 0.8).expect("it is positive");
        let normals = Normals {
            gram: columns.tr_mul(&columns),
            pull: -columns.tr_mul(&residuals),
            chi2: residuals.norm_squared(),
            freedom: 7.0,
        };
        let prior = Prior { columns: vec![0, 1, 2], root: root.clone() };
        let (matrix, pull) = normals.whitened(&prior);
        let (q, diagonal, off) = SymmetricTridiagonal::new(matrix).unpack();
        let pull = q.tr_mul(&pull);
        let of =
            |v: f64| normals.likelihood(&diagonal, &off, &pull, v) - normals.likelihood(&diagonal, &off, &pull, 0.0);
        let full = |v: f64| {
            let shaped = &columns * &root;
            let covariance = DMatrix::identity(7, 7) + &shaped * shaped.transpose() * v;
            let density = |m: &DMatrix<f64>| {
                let solved = m.clone().cholesky().expect("positive").solve(&residuals);
                -0.5 * (math::ln(m.determinant()) + residuals.dot(&solved))
            };
            density(&covariance) - density(&DMatrix::identity(7, 7))
        };
        for v in [0.01, 0.3, 2.0, 50.0] {
            assert!((of(v) - full(v)).abs() < 1e-9, "{v}: {} {}", of(v), full(v));
        }
    }
}
