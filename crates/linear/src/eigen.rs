//! Eigenvalues of a real matrix.

mod deflation;

use deflation::Rounded;
use mops_math as math;
use nalgebra::DMatrix;

use super::Complex;
use super::components::strong_components;
use super::extended::{Entry, Extended, Real, extended, rounded};
use super::qr_steps::{hessenberg, hessenberg_eigenvalues};

/// Returns the eigenvalues of a square matrix, complex ones as exact conjugate pairs, upper one first.
///
/// The matrix is split into its strongly connected components. Each is balanced, deflated of zero eigenvalues, reduced
/// to Hessenberg form and treated by QR steps, with twice the digits of `f64`. The eigenvalue of a component of one
/// state is its diagonal entry, exactly.
///
/// # Errors
/// If an entry is not finite or, very rarely, the QR steps do not converge.
pub fn eigenvalues(a: &DMatrix<f64>) -> Result<Vec<Complex>, String> {
    eigenvalues_of(&extended(a), f64::EPSILON)
}

/// Returns the eigenvalues of the given numbers as they stand: none is zero because the rounding of the entries
/// explains it, see
/// [`eigenvalues`].
///
/// # Errors
/// See [`eigenvalues`].
pub(super) fn eigenvalues_as_given(a: &DMatrix<f64>) -> Result<Vec<Complex>, String> {
    eigenvalues_of(&extended(a), Extended::EPSILON)
}

/// Returns the eigenvalues of a square matrix with the digits of its entries, whose relative rounding error is given,
/// see
/// [`eigenvalues`].
///
/// # Errors
/// See [`eigenvalues`].
pub(super) fn eigenvalues_of<T: Real>(a: &DMatrix<T>, rounding: f64) -> Result<Vec<Complex>, String> {
    let mut roots = Vec::with_capacity(a.nrows());
    for part in balanced_blocks(a, rounding)? {
        roots.extend(part.eigenvalues()?);
    }
    roots.resize(a.nrows(), Complex::new(0.0, 0.0));
    Ok(roots)
}

/// Returns the eigenvalues that a perturbation of rounding size moves onto the imaginary axis.
///
/// Eigenvalues of components of one state are exact, and so are zeros from dependent rows: neither is ever returned. An
/// eigenvalue `z` is returned if the smallest singular value of `A - s` is at most `n eps |A|` all the way from `s = z`
/// to `s = i Im z`.
///
/// Source: L. N. Trefethen, M. Embree, Spectra and Pseudospectra (2005), section 2.
///
/// # Errors
/// See [`eigenvalues`].
pub fn undecided(a: &DMatrix<f64>) -> Result<Vec<Complex>, String> {
    let mut found = Vec::new();
    for part in balanced_blocks(&extended(a), f64::EPSILON)?.into_iter().filter(|part| part.matrix.nrows() > 1) {
        let (matrix, n) = (rounded(&part.matrix), part.matrix.nrows() as f64);
        let size = n * f64::EPSILON * matrix.norm();
        found.extend(
            part.eigenvalues()?.into_iter().filter(|root| is_moved_onto_axis(&matrix, root / part.scale, size)),
        );
    }
    Ok(found)
}

/// Strongly connected component of a matrix, balanced and divided by `scale`.
struct Block<T: Real> {
    matrix: DMatrix<T>,
    scale: f64,
}

impl<T: Real> Block<T> {
    fn eigenvalues(&self) -> Result<Vec<Complex>, String> {
        let roots = hessenberg_eigenvalues(hessenberg(self.matrix.clone()));
        let roots = roots.ok_or("the eigenvalues were not found: the QR steps do not converge")?;
        Ok(roots.into_iter().map(|root| root * self.scale).collect())
    }
}

/// Returns true if a perturbation of this size moves an eigenvalue onto the imaginary axis: if the smallest singular
/// value of `A - s` is at most that all the way. Multiple eigenvalues, which rounding moves far, count as one.
pub(super) fn is_moved_onto_axis(a: &DMatrix<f64>, root: Complex, size: f64) -> bool {
    let least = |s: Complex| {
        let mut shifted = a.map(|x| Complex::new(x, 0.0));
        (0..a.nrows()).for_each(|i| shifted[(i, i)] -= s);
        shifted.singular_values().min()
    };
    [0.5, 0.0, 0.25, 0.75].iter().all(|&share| least(Complex::new(share * root.re, root.im)) <= size)
}

/// Returns the strongly connected components, deflated of zero eigenvalues.
fn balanced_blocks<T: Real>(a: &DMatrix<T>, rounding: f64) -> Result<Vec<Block<T>>, String> {
    if a.iter().any(|x| !x.size().is_finite()) {
        return Err("a matrix with an entry that is not finite has no eigenvalues".to_owned());
    }
    let mut blocks = Vec::new();
    let mut open = vec![Rounded::given(a.clone(), rounding)];
    while let Some(a) = open.pop() {
        for indices in strong_components(&a.entries) {
            let mut part = a.block(&indices);
            // A power of two avoids rounding; squares of the scaled entries stay within the number range.
            let scale = math::exp2(math::log2(part.entries.iter().map(|x| x.size()).fold(0.0, f64::max)).floor());
            let scale = if scale > 0.0 && scale.is_finite() { scale } else { 1.0 };
            part = part.scaled(1.0 / scale);
            let scales = balance(&mut part.entries);
            for (i, scale) in scales.into_iter().enumerate() {
                part.errors.row_mut(i).unscale_mut(scale);
                part.errors.column_mut(i).scale_mut(scale);
            }
            match part.without_zero() {
                Some(rest) => open.push(rest.scaled(scale)),
                None => blocks.push(Block { matrix: part.entries, scale }),
            }
        }
    }
    Ok(blocks)
}

/// Scales rows and columns by powers of two so that their norms agree, and returns the factors of the columns. This is
/// a similarity without rounding.
///
/// Norms include the diagonal, so that entries at rounding level are not amplified. Source: R. James, J. Langou, B. R.
/// Lowery, On matrix balancing and eigenvector computation, arXiv:1401.5766 (2014).
pub(super) fn balance<T: Real>(a: &mut DMatrix<T>) -> Vec<f64> {
    let n = a.nrows();
    let mut scales = vec![1.0; n];
    for _ in 0..100 {
        let mut changed = false;
        for i in 0..n {
            let norm = |at: &dyn Fn(usize) -> (usize, usize)| {
                let sizes = (0..n).map(|j| a[at(j)].size());
                sizes.map(|x| x * x).sum::<f64>().sqrt()
            };
            let factor = balancing_factor(norm(&|j| (i, j)), norm(&|j| (j, i)));
            if factor != 1.0 {
                changed = true;
                scales[i] *= factor;
                (0..n).for_each(|j| a[(i, j)] = a[(i, j)].scaled(1.0 / factor));
                (0..n).for_each(|j| a[(j, i)] = a[(j, i)].scaled(factor));
            }
        }
        if !changed {
            break;
        }
    }
    scales
}

/// Returns the power of two by which a column is multiplied and its row divided; 1 if the gain is small.
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
