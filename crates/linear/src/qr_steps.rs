//! Hessenberg form, and QR steps with implicit double shift on it.

use mops_math as math;
use nalgebra::DMatrix;

use super::Complex;
use super::extended::{Entry, Real, norm};

/// Number of steps without a new eigenvalue after which an exceptional shift is used. Source: LAPACK, `dlahqr`.
pub(super) const EXCEPTIONAL: usize = 10;

/// Number of steps without a new eigenvalue after which a subdiagonal entry counts as zero relative to the whole
/// matrix.
///
/// This is a perturbation of rounding size, though not relative to the neighbours. Three exceptional shifts have failed
/// by then.
pub(super) const LENIENT: usize = 3 * EXCEPTIONAL + 1;

/// Number of steps without a new eigenvalue after which the iteration fails.
pub(super) const MOST: usize = 300;

/// Returns the Hessenberg form of a matrix, by reflections of its columns and rows.
///
/// Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th edition (2013), algorithm 7.4.2.
pub(super) fn hessenberg<T: Real>(mut a: DMatrix<T>) -> DMatrix<T> {
    let n = a.nrows();
    for k in 0..n.saturating_sub(2) {
        let mut v: Vec<T> = (k + 1..n).map(|i| a[(i, k)]).collect();
        let (beta, factor) = reflection(&mut v);
        if factor == T::ZERO {
            continue;
        }
        a[(k + 1, k)] = beta;
        (k + 2..n).for_each(|i| a[(i, k)] = T::ZERO);
        for j in k + 1..n {
            reflect(&v, factor, |i| (k + 1 + i, j), &mut a);
        }
        for i in 0..n {
            reflect(&v, factor, |j| (i, k + 1 + j), &mut a);
        }
    }
    a
}

/// Reflects the entries at these places, a part of a row or of a column.
fn reflect<T: Real>(v: &[T], factor: T, place: impl Fn(usize) -> (usize, usize), a: &mut DMatrix<T>) {
    let sum = v.iter().enumerate().fold(T::ZERO, |sum, (i, v)| sum + *v * a[place(i)]);
    let sum = factor * sum;
    v.iter().enumerate().for_each(|(i, v)| a[place(i)] -= *v * sum);
}

/// Returns the eigenvalues of a real Hessenberg matrix, or `None` without convergence.
///
/// Source: LAPACK 3.12, description of `dlahqr`; B. T. Smith et al., Matrix Eigensystem Routines, EISPACK Guide, 2nd
/// edition (1976), `hqr`.
pub(super) fn hessenberg_eigenvalues<T: Real>(mut h: DMatrix<T>) -> Option<Vec<Complex>> {
    let mut roots = Vec::with_capacity(h.nrows());
    let norm = norm(&h);
    let (mut end, mut step) = (h.nrows(), 0);
    while end > 0 {
        let hi = end - 1;
        let lo = decoupled(&mut h, hi, if step >= LENIENT { norm } else { 0.0 });
        if lo + 1 >= hi {
            let found = if lo == hi { vec![Complex::new(h[(hi, hi)].value(), 0.0)] } else { pair(&h, lo).to_vec() };
            roots.extend(found.into_iter().rev());
            (end, step) = (lo, 0);
            continue;
        }
        step += 1;
        if step > MOST {
            return None;
        }
        let shifts = shifts(&h, lo, hi, step);
        let start = start(&h, lo, hi, shifts);
        double_step(&mut h, lo, hi, start);
    }
    roots.reverse();
    Some(roots)
}

/// Returns the start of the block of a Hessenberg matrix that ends at `hi`.
///
/// A negligible subdiagonal entry decouples the block and is set to zero. Entries that are small relative to `norm`
/// count too.
pub(super) fn decoupled<T: Entry>(h: &mut DMatrix<T>, hi: usize, norm: f64) -> usize {
    for lo in (1..=hi).rev() {
        if negligible(h, lo, hi) || h[(lo, lo - 1)].size() <= T::EPSILON * norm {
            h[(lo, lo - 1)] = T::ZERO;
            return lo;
        }
    }
    0
}

/// Returns true if the subdiagonal entry in row `k` is negligible relative to its neighbours.
///
/// The test relates its product with the entry across the diagonal to the difference of the diagonal entries.
///
/// Source: M. Ahues, F. Tisseur, A new deflation criterion for the QR algorithm, LAPACK Working Note 122 (1997).
fn negligible<T: Entry>(h: &DMatrix<T>, k: usize, hi: usize) -> bool {
    let size = |i: usize, j: usize| h[(i, j)].size();
    let below = size(k, k - 1);
    let tiny = f64::MIN_POSITIVE * (hi + 1) as f64 / T::EPSILON;
    if below <= tiny {
        return true;
    }
    let mut around = size(k - 1, k - 1) + size(k, k);
    if around == 0.0 {
        // Zero diagonal: the neighbouring entries give the scale.
        around += if k >= 2 { size(k - 1, k - 2) } else { 0.0 };
        around += if k < hi { size(k + 1, k) } else { 0.0 };
    }
    if below > T::EPSILON * around {
        return false;
    }
    let above = size(k - 1, k);
    let (large, small) = (below.max(above), below.min(above));
    let difference = (h[(k - 1, k - 1)] - h[(k, k)]).size();
    let (most, least) = (size(k, k).max(difference), size(k, k).min(difference));
    let sum = most + large;
    small * (large / sum) <= tiny.max(T::EPSILON * (least * (most / sum)))
}

/// Returns the two shifts of a step, `half +- sqrt(-determinant)`, as `half` and `determinant`.
fn shifts<T: Real>(h: &DMatrix<T>, lo: usize, hi: usize, step: usize) -> [T; 2] {
    let at = |i: usize, j: usize| h[(i, j)];
    // Exceptional shifts alternate between the lower and the upper end. Source: LAPACK, `dlahqr`.
    let exceptional = |diagonal: T, s: T| {
        let moved = T::from(0.75) * s + diagonal;
        [moved, T::from(-0.4375) * s, s, moved]
    };
    let [a, b, c, d] = if step.is_multiple_of(2 * EXCEPTIONAL) {
        exceptional(at(hi, hi), at(hi, hi - 1).abs() + at(hi - 1, hi - 2).abs())
    } else if step.is_multiple_of(EXCEPTIONAL) {
        exceptional(at(lo, lo), at(lo + 1, lo).abs() + at(lo + 2, lo + 1).abs())
    } else {
        [at(hi - 1, hi - 1), at(hi - 1, hi), at(hi, hi - 1), at(hi, hi)]
    };
    let half = (a + d).scaled(0.5);
    let determinant = (a - half) * (d - half) - b * c;
    if determinant >= T::ZERO {
        return [half, determinant];
    }
    // Two real shifts: the one nearer to the last entry, twice.
    let root = (-determinant).sqrt();
    let (first, second) = (half + root, half - root);
    let nearer = if (first - d).abs() <= (second - d).abs() { first } else { second };
    [nearer, T::ZERO]
}

/// Returns the start row of the step and the first column of `(H - half)^2 + determinant` there, up to a factor.
///
/// The step can start where the two adjacent subdiagonal entries together are small.
fn start<T: Real>(h: &DMatrix<T>, lo: usize, hi: usize, [half, determinant]: [T; 2]) -> (usize, [T; 3]) {
    let mut m = hi - 2;
    loop {
        let (z, below, next) = (h[(m, m)], h[(m + 1, m)], h[(m + 1, m + 1)]);
        let v = [
            below * h[(m, m + 1)] + (z - half) * (z - half) + determinant,
            below * ((z - half) + (next - half)),
            below * h[(m + 2, m + 1)],
        ];
        let size = v.iter().fold(T::ZERO, |sum, x| sum + x.abs());
        let v = if size > T::ZERO { v.map(|x| x / size) } else { [T::from(1.0), T::ZERO, T::ZERO] };
        if m == lo {
            return (m, v);
        }
        let around = h[(m - 1, m - 1)].size() + z.size() + next.size();
        if h[(m, m - 1)].size() * (v[1].size() + v[2].size()) <= T::EPSILON * v[0].size() * around {
            return (m, v);
        }
        m -= 1;
    }
}

/// Performs one implicit step on rows and columns `lo` to `hi`: reflections chase a bulge down from row `m`.
fn double_step<T: Real>(h: &mut DMatrix<T>, lo: usize, hi: usize, (m, column): (usize, [T; 3])) {
    for k in m..hi {
        let rows = (hi - k + 1).min(3);
        let mut v = if k > m { (0..rows).map(|i| h[(k + i, k - 1)]).collect() } else { column[..rows].to_vec() };
        let (beta, factor) = reflection(&mut v);
        if k > m {
            h[(k, k - 1)] = beta;
            (1..rows).for_each(|i| h[(k + i, k - 1)] = T::ZERO);
        } else if m > lo {
            let before = h[(k, k - 1)];
            h[(k, k - 1)] -= factor * before;
        }
        for j in k..=hi {
            reflect(&v, factor, |i| (k + i, j), h);
        }
        for i in lo..=hi.min(k + 3) {
            reflect(&v, factor, |j| (i, k + j), h);
        }
    }
}

/// Replaces `x` by the vector `v`, with a first entry of 1, of the reflection `1 - factor v v^T` that maps `x` to
/// `(beta, 0, ...)`. Returns `beta` and `factor`.
pub(super) fn reflection<T: Real>(x: &mut [T]) -> (T, T) {
    let largest = x[1..].iter().map(|x| x.size()).fold(0.0, f64::max);
    let first = x[0];
    x[0] = T::from(1.0);
    if largest == 0.0 {
        return (first, T::ZERO);
    }
    // A power of two keeps squares within the number range.
    let scale = math::exp2(math::log2(largest.max(first.size())).floor());
    let squares = x[1..].iter().map(|x| x.scaled(1.0 / scale)).fold(T::ZERO, |sum, x| sum + x * x);
    let small = first.scaled(1.0 / scale);
    let length = (small * small + squares).sqrt().scaled(scale);
    let beta = if first < T::ZERO { length } else { -length };
    let divisor = first - beta;
    x[1..].iter_mut().for_each(|x| *x = *x / divisor);
    (beta, (beta - first) / beta)
}

/// Returns the eigenvalues of the 2 x 2 block at row `k`.
fn pair<T: Real>(h: &DMatrix<T>, k: usize) -> [Complex; 2] {
    let (y, x, w) = (h[(k, k)], h[(k + 1, k + 1)], h[(k + 1, k)] * h[(k, k + 1)]);
    let p = (y - x).scaled(0.5);
    let q = p * p + w;
    let root = q.abs().sqrt();
    if q >= T::ZERO {
        let z = if p < T::ZERO { p - root } else { p + root };
        let other = if z == T::ZERO { x + z } else { x - w / z };
        [x + z, other].map(|re| Complex::new(re.value(), 0.0))
    } else {
        [Complex::new((x + p).value(), root.value()), Complex::new((x + p).value(), -root.value())]
    }
}
