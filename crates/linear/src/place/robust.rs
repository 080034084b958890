//! Robust pole placement: eigenvectors as independent as possible.

use mops_math::complex;
use nalgebra::{DMatrix, DVector};

use super::complement::complement;
use crate::Complex;
use crate::system::beside;

/// Returns the closed loop `A - B K` with eigenvectors as independent as possible; `range` spans the columns of `B`.
/// Returns `None` if the eigenvectors are dependent.
///
/// Source: J. Kautsky, N. K. Nichols, P. Van Dooren, Robust pole assignment in linear state feedback, International
/// Journal of Control 41 (1985) 1129-1155, method 0; for complex pairs A. L. Tits, Y. Yang, Globally convergent
/// algorithms for robust pole assignment by state feedback, IEEE Transactions on Automatic Control 41 (1996) 1432-1452.
pub(super) fn robust(a: &DMatrix<f64>, range: &DMatrix<f64>, poles: &[Complex]) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    let beyond = complement(range).map(|x| Complex::new(x, 0.0));
    // Eigenvectors attainable for a pole: the span of the columns of its space.
    let leading: Vec<usize> = (0..n).filter(|&j| poles[j].im >= 0.0).collect();
    let space = |pole: Complex| {
        let shifted = a.map(|x| Complex::new(x, 0.0)) - DMatrix::identity(n, n) * pole;
        complement(&(beyond.adjoint() * shifted).adjoint())
    };
    let spaces: Vec<DMatrix<Complex>> = leading.iter().map(|&j| space(poles[j])).collect();
    let mut x = DMatrix::<f64>::zeros(n, n);
    for (&j, space) in leading.iter().zip(&spaces) {
        let found = x.columns(0, j).into_owned();
        set(&mut x, j, poles[j], &first(space, &found))?;
    }
    let mut merit = x.determinant().abs();
    let mut best = (merit, x.clone());
    for _ in 0..100 {
        for (&j, space) in leading.iter().zip(&spaces) {
            let width = if poles[j].im == 0.0 { 1 } else { 2 };
            let others = beside(&x.columns(0, j).into_owned(), &x.columns(j + width, n - j - width).into_owned());
            set(&mut x, j, poles[j], &(space * most_independent(space, &complement(&others))))?;
        }
        let next = x.determinant().abs();
        if next > best.0 {
            best = (next, x.clone());
        }
        if (next - merit).abs() <= 1e-8 * next {
            break;
        }
        merit = next;
    }
    let (x, mut modes) = (best.1, DMatrix::zeros(n, n));
    for &j in &leading {
        modes[(j, j)] = poles[j].re;
        if poles[j].im > 0.0 {
            modes[(j + 1, j + 1)] = poles[j].re;
            modes[(j, j + 1)] = poles[j].im;
            modes[(j + 1, j)] = -poles[j].im;
        }
    }
    let inverse = x.clone().try_inverse()?;
    let closed = x * modes * inverse;
    closed.iter().all(|z| z.is_finite()).then_some(closed)
}

/// Returns an initial eigenvector in the space, far from the span of those found.
fn first(space: &DMatrix<Complex>, found: &DMatrix<f64>) -> DVector<Complex> {
    let rest = complement(found).map(|x| Complex::new(x, 0.0));
    let svd = (rest.adjoint() * space).svd(false, true);
    let v = svd.v_t.expect("the SVD computes V").adjoint();
    let second =
        if v.ncols() > 1 { v.column(1) * Complex::new(0.0, 0.5) } else { v.column(0) * Complex::new(0.0, 0.0) };
    space * (v.column(0) + second)
}

/// Returns the weights of the columns of `space` whose combination maximises the determinant of all eigenvectors. If
/// `complement` has two columns, the eigenvector enters together with its conjugate.
pub(super) fn most_independent(space: &DMatrix<Complex>, complement: &DMatrix<f64>) -> DVector<Complex> {
    let y = complement.map(|x| Complex::new(x, 0.0));
    if y.ncols() == 1 {
        return space.adjoint() * y.column(0);
    }
    let turn = (y.column(1) * y.column(0).adjoint() - y.column(0) * y.column(1).adjoint()) * Complex::i();
    let eigen = (space.adjoint() * turn * space).symmetric_eigen();
    eigen.eigenvectors.column(eigen.eigenvalues.iamax()).into_owned()
}

/// Stores a unit eigenvector in column `j`; for a complex pole, its real and imaginary parts in columns `j` and
/// `j + 1`. Returns `None` for a zero vector.
fn set(x: &mut DMatrix<f64>, j: usize, pole: Complex, vector: &DVector<Complex>) -> Option<()> {
    let length = vector.norm();
    if !(length > 0.0 && length.is_finite()) {
        return None;
    }
    if pole.im == 0.0 {
        // Rotated so that the largest entry is real; the others then are real too.
        let turn = vector[vector.icamax()];
        let real = (vector * (turn.conj() / complex::norm(turn))).map(|z| z.re);
        x.set_column(j, &real.normalize());
    } else {
        let unit = vector / Complex::new(length, 0.0);
        x.set_column(j, &unit.map(|z| z.re));
        x.set_column(j + 1, &unit.map(|z| z.im));
    }
    Some(())
}
