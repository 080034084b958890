//! Eigenvalues of a real matrix.

mod deflation;

use deflation::Rounded;
use nalgebra::DMatrix;

use super::Complex;
use super::components::{block, strong_components};
use super::qr_steps::hessenberg_eigenvalues;
use crate::math;

/// The eigenvalues of a square matrix, complex ones as exact conjugate pairs, the one above the real axis first.
///
/// The matrix is split into its strong components, each of them balanced, freed from eigenvalues that are 0, brought to
/// Hessenberg form and treated by QR steps. An eigenvalue of a component of one state is its diagonal entry, exactly.
///
/// # Errors
/// An entry that is not finite, or, hardly ever, no convergence.
pub fn eigenvalues(a: &DMatrix<f64>) -> Result<Vec<Complex>, String> {
    let mut roots = Vec::with_capacity(a.nrows());
    for part in balanced_blocks(a)? {
        roots.extend(part.eigenvalues()?);
    }
    roots.resize(a.nrows(), Complex::new(0.0, 0.0));
    Ok(roots)
}

/// The eigenvalues that rounding cannot tell from numbers on the imaginary axis: a perturbation of the size of the rounding
/// errors moves them there. Those of a component of one state are exact, and so are those that are 0 as rows depend on one
/// another: they are never among them.
///
/// An eigenvalue `z` is among them where the smallest singular value of `A - s` is at most `n eps |A|` all the way from
/// `s = z` to `s = i Im z`. Source: L. N. Trefethen, M. Embree, Spectra and Pseudospectra (2005), section 2.
///
/// # Errors
/// As [`eigenvalues`].
pub fn undecided(a: &DMatrix<f64>) -> Result<Vec<Complex>, String> {
    let mut found = Vec::new();
    for part in balanced_blocks(a)?.into_iter().filter(|part| part.matrix.nrows() > 1) {
        for root in part.eigenvalues()? {
            let on_the_way = |share: f64| Complex::new(share * root.re, root.im) / part.scale;
            if [0.5, 0.0, 0.25, 0.75].iter().all(|&share| part.is_nearly_eigenvalue(on_the_way(share))) {
                found.push(root);
            }
        }
    }
    Ok(found)
}

/// A strong component of a matrix, balanced and divided by `scale`.
struct Block {
    matrix: DMatrix<f64>,
    scale: f64,
}

impl Block {
    fn eigenvalues(&self) -> Result<Vec<Complex>, String> {
        let h = if self.matrix.nrows() > 2 { self.matrix.clone().hessenberg().unpack_h() } else { self.matrix.clone() };
        let roots = hessenberg_eigenvalues(h);
        let roots = roots.ok_or("the eigenvalues were not found: the QR steps do not converge")?;
        Ok(roots.into_iter().map(|root| root * self.scale).collect())
    }

    /// Whether a perturbation of the size of the rounding errors makes `z` an eigenvalue of the matrix.
    fn is_nearly_eigenvalue(&self, z: Complex) -> bool {
        let n = self.matrix.nrows();
        let mut shifted = self.matrix.map(|x| Complex::new(x, 0.0));
        (0..n).for_each(|i| shifted[(i, i)] -= z);
        shifted.singular_values().min() <= n as f64 * f64::EPSILON * self.matrix.norm()
    }
}

/// The strong components but for eigenvalues that are 0, which are left out.
fn balanced_blocks(a: &DMatrix<f64>) -> Result<Vec<Block>, String> {
    if a.iter().any(|x| !x.is_finite()) {
        return Err("a matrix with an entry that is not finite has no eigenvalues".to_owned());
    }
    let mut blocks = Vec::new();
    let mut open = vec![Rounded::given(a.clone())];
    while let Some(a) = open.pop() {
        for indices in strong_components(&a.entries) {
            let mut part = a.map(|m| block(m, &indices));
            // A power of two, so that nothing is rounded; squares of entries then stay within the range of numbers.
            let scale = math::exp2(math::log2(part.entries.amax()).floor());
            let scale = if scale > 0.0 && scale.is_finite() { scale } else { 1.0 };
            part = part.map(|m| m / scale);
            let scales = balance(&mut part.entries);
            for (i, scale) in scales.into_iter().enumerate() {
                part.errors.row_mut(i).unscale_mut(scale);
                part.errors.column_mut(i).scale_mut(scale);
            }
            match part.without_zero() {
                Some(rest) => open.push(rest.map(|m| m * scale)),
                None => blocks.push(Block { matrix: part.entries, scale }),
            }
        }
    }
    Ok(blocks)
}

/// Scales rows and columns by powers of two, so that their norms agree: a similarity, without rounding. Returns the factors
/// of the columns.
///
/// Norms include the diagonal, so that entries which are rounding errors are not blown up. Source: R. James, J. Langou, B.
/// R. Lowery, On matrix balancing and eigenvector computation, arXiv:1401.5766 (2014).
pub(super) fn balance(a: &mut DMatrix<f64>) -> Vec<f64> {
    let n = a.nrows();
    let mut scales = vec![1.0; n];
    for _ in 0..100 {
        let mut changed = false;
        for i in 0..n {
            let factor = balancing_factor(a.row(i).norm(), a.column(i).norm());
            if factor != 1.0 {
                changed = true;
                scales[i] *= factor;
                a.row_mut(i).unscale_mut(factor);
                a.column_mut(i).scale_mut(factor);
            }
        }
        if !changed {
            break;
        }
    }
    scales
}

/// The power of two by which a column is multiplied and its row divided; 1 where little would be won.
pub(super) fn balancing_factor(row: f64, column: f64) -> f64 {
    if row == 0.0 || column == 0.0 || !(row + column).is_finite() {
        return 1.0;
    }
    let (mut factor, mut scaled): (f64, f64) = (1.0, column);
    while scaled < row / 2.0 && factor < 1e100 {
        factor *= 2.0;
        scaled *= 4.0;
    }
    while scaled >= row * 2.0 && factor > 1e-100 {
        factor /= 2.0;
        scaled /= 4.0;
    }
    if (scaled + row) / factor < 0.95 * (column + row) { factor } else { 1.0 }
}

#[cfg(test)]
mod tests;
