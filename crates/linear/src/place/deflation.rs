//! Pole placement by deflation: one invariant direction of the closed loop after the other.

use nalgebra::{DMatrix, DVector};

use super::complement::complement;
use super::robust::most_independent;
use crate::Complex;

/// Returns the feedback that places one pole after the other.
///
/// Each step fixes a closed-loop eigenvector, or for a pair the plane of both, and continues on the complement. Poles
/// may be repeated any number of times; they get Jordan blocks where the inputs allow nothing else. With several
/// inputs, the combination with the smallest effort is used. Returns `None` if a direction cannot be found.
///
/// Source: G. Miminis, C. C. Paige, An algorithm for pole assignment of time invariant linear systems, International
/// Journal of Control 35 (1982) 341-354; with several inputs as in A. Varga, A Schur method for pole assignment, IEEE
/// Transactions on Automatic Control 26 (1981) 517-519.
pub(super) fn deflated(a: &DMatrix<f64>, b: &DMatrix<f64>, poles: &[Complex]) -> Option<DMatrix<f64>> {
    let n = a.nrows();
    let (mut a, mut b) = (a.clone(), b.clone());
    let mut basis = DMatrix::<f64>::identity(n, n);
    let mut k = DMatrix::<f64>::zeros(b.ncols(), n);
    for &pole in poles.iter().filter(|pole| pole.im >= 0.0) {
        // Columns of x: directions of the closed loop; columns of v: their feedback.
        let (x, v) = if pole.im == 0.0 { single(&a, &b, pole.re) } else { pair(&a, &b, pole)? };
        let qr = x.qr();
        let (q, r) = (qr.q(), qr.r());
        k += v * r.try_inverse()? * (&basis * &q).transpose();
        let rest = complement(&q);
        a = rest.transpose() * a * &rest;
        b = rest.transpose() * b;
        basis *= rest;
    }
    k.iter().all(|x| x.is_finite()).then_some(k)
}

/// Returns the direction x of a real pole and its v, with `(A - pole) x = B v` and the smallest `|v|/|x|`.
fn single(a: &DMatrix<f64>, b: &DMatrix<f64>, pole: f64) -> (DMatrix<f64>, DMatrix<f64>) {
    let (n, inputs) = (a.nrows(), b.ncols());
    let mut both = DMatrix::zeros(n, n + inputs);
    both.columns_mut(0, n).copy_from(a);
    both.columns_mut(n, inputs).copy_from(&-b);
    (0..n).for_each(|i| both[(i, i)] -= pole);
    let solutions = complement(&both.transpose());
    let upper = solutions.rows(0, n).into_owned();
    let svd = upper.clone().svd(false, true);
    let best = svd.singular_values.imax();
    let weights = svd.v_t.expect("the SVD computes V").row(best).transpose();
    let columns = |x: DVector<f64>| DMatrix::from_column_slice(x.len(), 1, x.as_slice());
    (columns(upper * &weights), columns(solutions.rows(n, inputs) * weights))
}

/// Returns the real plane x of a complex pair and its v, with `(A - pole) x = B v`.
///
/// The two columns of x and of v are real and imaginary parts. Among all x with `|x|^2 + |v|^2 = 1`, the parts of the
/// chosen x span the largest area. Hence v is small and the plane well defined.
fn pair(a: &DMatrix<f64>, b: &DMatrix<f64>, pole: Complex) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let complex = |m: &DMatrix<f64>| m.map(|x| Complex::new(x, 0.0));
    let (n, inputs) = (a.nrows(), b.ncols());
    if n < 2 {
        return None;
    }
    let mut both = DMatrix::<Complex>::zeros(n, n + inputs);
    both.columns_mut(0, n).copy_from(&complex(a));
    both.columns_mut(n, inputs).copy_from(&complex(&-b));
    (0..n).for_each(|i| both[(i, i)] -= pole);
    let solutions = complement(&both.adjoint());
    let upper = solutions.rows(0, n).into_owned();
    let parts = |x: &DVector<Complex>| DMatrix::from_columns(&[x.map(|z| z.re), x.map(|z| z.im)]);
    // Ascent: the best x for a plane, then the plane of that x. The initial plane is the dominant one of all solutions.
    let mut all = DMatrix::zeros(n, 2 * inputs);
    all.columns_mut(0, inputs).copy_from(&upper.map(|z| z.re));
    all.columns_mut(inputs, inputs).copy_from(&upper.map(|z| z.im));
    let mut plane = all.svd(true, false).u.expect("the SVD computes U").columns(0, 2).into_owned();
    let mut weights = DVector::from_element(inputs, Complex::new(1.0, 0.0));
    for _ in 0..20 {
        weights = most_independent(&upper, &plane);
        plane = parts(&(&upper * &weights)).qr().q();
    }
    let (x, v) = (parts(&(&upper * &weights)), parts(&(solutions.rows(n, inputs) * &weights)));
    x.iter().chain(&v).all(|x| x.is_finite()).then_some((x, v))
}
