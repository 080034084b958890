//! Schur form: unitary similarity of a matrix to a triangular one.

use mops_math as math;
use mops_math::complex;
use nalgebra::DMatrix;

use super::Complex;
use super::qr_steps::{EXCEPTIONAL, LENIENT, MOST, decoupled};

/// Schur form `A = Q T Q^H` with `Q` unitary and `T` upper triangular; the diagonal of `T` holds the eigenvalues of
/// `A`.
///
/// Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th edition (2013), sections 7.5 and 7.6.
#[derive(Debug, Clone)]
pub struct Schur {
    /// Unitary factor.
    pub q: DMatrix<Complex>,
    /// Triangular factor.
    pub t: DMatrix<Complex>,
}

/// Givens rotation that maps `(x, y)` to `(r, 0)`.
struct Rotation {
    cosine: f64,
    sine: Complex,
}

impl Rotation {
    fn annihilating(x: Complex, y: Complex) -> Self {
        let r = math::hypot(complex::norm(x), complex::norm(y));
        if r == 0.0 {
            return Self { cosine: 1.0, sine: Complex::new(0.0, 0.0) };
        }
        if complex::norm(x) == 0.0 {
            return Self { cosine: 0.0, sine: y.conj() / complex::norm(y) };
        }
        Self { cosine: complex::norm(x) / r, sine: x / complex::norm(x) * y.conj() / r }
    }

    fn rows(&self, m: &mut DMatrix<Complex>, k: usize, columns: std::ops::Range<usize>) {
        for j in columns {
            let (a, b) = (m[(k, j)], m[(k + 1, j)]);
            m[(k, j)] = a * self.cosine + self.sine * b;
            m[(k + 1, j)] = b * self.cosine - self.sine.conj() * a;
        }
    }

    fn columns(&self, m: &mut DMatrix<Complex>, k: usize, rows: std::ops::Range<usize>) {
        for i in rows {
            let (a, b) = (m[(i, k)], m[(i, k + 1)]);
            m[(i, k)] = a * self.cosine + self.sine.conj() * b;
            m[(i, k + 1)] = b * self.cosine - self.sine * a;
        }
    }
}

impl Schur {
    /// Computes the Schur form of a square matrix.
    ///
    /// # Errors
    /// If an entry is not finite or, very rarely, the QR steps do not converge.
    pub fn new(a: DMatrix<Complex>) -> Result<Self, String> {
        if a.iter().any(|z| !z.is_finite()) {
            return Err("a matrix with an entry that is not finite has no Schur form".to_owned());
        }
        let n = a.nrows();
        let (mut q, mut t) = if n > 2 { a.hessenberg().unpack() } else { (DMatrix::identity(n, n), a) };
        let norm = t.norm();
        let mut hi = n.saturating_sub(1);
        let mut iteration = 0;
        while hi > 0 {
            let lo = decoupled(&mut t, hi, if iteration >= LENIENT { norm } else { 0.0 });
            if lo == hi {
                hi -= 1;
                iteration = 0;
                continue;
            }
            iteration += 1;
            if iteration > MOST {
                return Err("the Schur form was not found: the QR steps do not converge".to_owned());
            }
            let shift =
                if iteration % EXCEPTIONAL == 0 { t[(hi, hi)] + complex::norm(t[(hi, hi - 1)]) } else { shift(&t, hi) };
            let (mut x, mut y) = (t[(lo, lo)] - shift, t[(lo + 1, lo)]);
            for k in lo..hi {
                let rotation = Rotation::annihilating(x, y);
                rotation.rows(&mut t, k, k.max(lo + 1) - 1..n);
                rotation.columns(&mut t, k, 0..(k + 3).min(hi + 1));
                rotation.columns(&mut q, k, 0..n);
                if k + 1 < hi {
                    (x, y) = (t[(k + 1, k)], t[(k + 2, k)]);
                }
            }
        }
        t.fill_lower_triangle(Complex::new(0.0, 0.0), 1);
        Ok(Self { q, t })
    }

    /// Computes the Schur form of a real matrix.
    ///
    /// # Errors
    /// See [`Schur::new`].
    pub fn of(a: &DMatrix<f64>) -> Result<Self, String> {
        Self::new(a.map(|x| Complex::new(x, 0.0)))
    }

    /// Moves the `wanted` eigenvalues to the front and returns their number.
    ///
    /// Source: Z. Bai, J. W. Demmel, On swapping diagonal blocks in real Schur form, Linear Algebra and its
    /// Applications 186 (1993) 75-95; here every block is 1 x 1.
    pub fn reorder(&mut self, wanted: impl Fn(Complex) -> bool) -> usize {
        let n = self.t.nrows();
        let mut count = 0;
        for i in 0..n {
            if wanted(self.t[(i, i)]) {
                for k in (count..i).rev() {
                    self.swap(k);
                }
                count += 1;
            }
        }
        count
    }

    /// Swaps eigenvalues `k` and `k + 1`.
    fn swap(&mut self, k: usize) {
        let n = self.t.nrows();
        let (first, second) = (self.t[(k, k)], self.t[(k + 1, k + 1)]);
        let rotation = Rotation::annihilating(self.t[(k, k + 1)], second - first);
        rotation.rows(&mut self.t, k, k..n);
        rotation.columns(&mut self.t, k, 0..k + 2);
        rotation.columns(&mut self.q, k, 0..n);
        self.t[(k + 1, k)] = Complex::new(0.0, 0.0);
        (self.t[(k, k)], self.t[(k + 1, k + 1)]) = (second, first);
    }
}

/// Returns the eigenvalue of the last 2 x 2 block that is nearer to its last entry (Wilkinson shift).
fn shift(t: &DMatrix<Complex>, hi: usize) -> Complex {
    let (a, d) = (t[(hi - 1, hi - 1)], t[(hi, hi)]);
    let half = (a - d) * 0.5;
    let product = t[(hi - 1, hi)] * t[(hi, hi - 1)];
    let root = complex::sqrt(half * half + product);
    let far = if complex::norm(half + root) > complex::norm(half - root) { half + root } else { half - root };
    if complex::norm(far) == 0.0 { d } else { d - product / far }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigenvalues;
    use crate::testing::{assert_same_set, c, random};

    #[test]
    fn the_factors_give_the_matrix_back() {
        for n in 1..=10 {
            let a = random(n, n, 7 + n as u64).map(|x| c(x, 0.0));
            let Schur { q, t } = Schur::new(a.clone()).unwrap();
            assert!((&q * &t * q.adjoint() - &a).norm() < 1e-13 * n as f64);
            assert!((q.adjoint() * &q - DMatrix::identity(n, n)).norm() < 1e-13 * n as f64);
        }
    }

    #[test]
    fn eigenvalues_move_to_the_front_and_the_factors_still_give_the_matrix() {
        let a = random(8, 8, 3);
        let mut schur = Schur::of(&a).unwrap();
        let count = schur.reorder(|z| z.re < 0.0);
        for i in 0..8 {
            assert_eq!(schur.t[(i, i)].re < 0.0, i < count);
        }
        assert!((&schur.q * &schur.t * schur.q.adjoint() - a.map(|x| c(x, 0.0))).norm() < 1e-12);
        let diagonal: Vec<Complex> = schur.t.diagonal().iter().copied().collect();
        assert_same_set(&diagonal, &eigenvalues(&a).unwrap(), 1e-12);
    }
}
